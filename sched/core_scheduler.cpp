#include "sched/core_scheduler.h"

#include <algorithm>

#include "base/contract.h"

namespace qduino::sched {

CoreScheduler::CoreScheduler() { slots_.fill(kNoSlot); }

// ---- the table ----------------------------------------------------------------------------------

bool CoreScheduler::add(VcpuId id, VcpuParameters parameters, Instant now, MainVcpuOptions options) {
    if (!parameters.valid() || contains(id) || main_count_ == kMainVcpuLimit) return false;
    if (options.owns_core && !parameters.whole_core()) return false;
    insert({.id = id,
            .owns_core = options.owns_core,
            .blocked_at = now,
            .server = options.deferrable ? Server{DeferrableServer{parameters, now}}
                                         : Server{SporadicServer{parameters, now, options.server}}});
    ++main_count_;
    return true;
}

bool CoreScheduler::add_io(VcpuId id, VcpuParameters parameters, Instant now, IoVcpuOptions options) {
    if (!parameters.valid() || contains(id) || io_count_ == kIoVcpuLimit) return false;
    insert({.id = id,
            .overrun = options.overrun,
            .server = Pibs{parameters, now, options.activation, options.client_period}});
    ++io_count_;
    return true;
}

void CoreScheduler::insert(const Vcpu& vcpu) {
    slots_[vcpu.id] = static_cast<std::uint8_t>(vcpus_.size());
    vcpus_.push_back(vcpu);
}

CoreScheduler::Vcpu& CoreScheduler::at(VcpuId id) {
    QDUINO_EXPECT(contains(id));
    return vcpus_[slots_[id]];
}

const CoreScheduler::Vcpu& CoreScheduler::at(VcpuId id) const {
    QDUINO_EXPECT(contains(id));
    return vcpus_[slots_[id]];
}

// ---- one VCPU -----------------------------------------------------------------------------------

const CoreScheduler::Vcpu& CoreScheduler::payer(const Vcpu& vcpu, Instant now) const {
    if (vcpu.inherited == Rank{} || vcpu.owns_core || !contains(vcpu.inherited.id)) return vcpu;
    const bool pays_itself = vcpu.server.available(now) > Nanoseconds{0} || overruns(vcpu, now);
    return pays_itself ? vcpu : at(vcpu.inherited.id);
}

Rank CoreScheduler::own_rank(const Vcpu& vcpu) { return {vcpu.server.rank_period(), vcpu.id}; }

Rank CoreScheduler::rank_of(const Vcpu& vcpu, Instant now) const {
    const bool at_own_rank = &payer(vcpu, now) == &vcpu && !overruns(vcpu, now);
    return at_own_rank ? std::min(own_rank(vcpu), vcpu.inherited) : vcpu.inherited;
}

bool CoreScheduler::overruns(const Vcpu& vcpu, Instant now) const {
    return vcpu.grace > Nanoseconds{0} && vcpu.inherited != Rank{} && !vcpu.owns_core &&
           (vcpu.overrun > Nanoseconds{0} || !contains(vcpu.inherited.id)) &&
           vcpu.server.available(now) == Nanoseconds{0};
}

Nanoseconds CoreScheduler::available(const Vcpu& vcpu, Instant now) const {
    if (vcpu.owns_core) return Nanoseconds::max();
    return overruns(vcpu, now) ? vcpu.grace : payer(vcpu, now).server.available(now);
}

// ---- events -------------------------------------------------------------------------------------

void CoreScheduler::wake(VcpuId id, Instant now, Instant due) {
    account(now);
    Vcpu& vcpu = at(id);
    vcpu.server.wake(vcpu.server.is_io() ? now : std::min(std::max(due, vcpu.blocked_at), now));
}

void CoreScheduler::wake_io(VcpuId id, Instant now, Nanoseconds client_period) {
    account(now);
    at(id).server.wake_for(now, client_period);
}

void CoreScheduler::change_io(VcpuId id, VcpuParameters parameters, Instant now) {
    account(now);
    at(id).server.change(now, parameters);
}

void CoreScheduler::release(VcpuId id, Instant nominal, Instant now) {
    account(now);
    at(id).server.release(nominal);
}

void CoreScheduler::block(VcpuId id, Instant now) {
    account(now);
    Vcpu& vcpu = at(id);
    vcpu.server.block(now);
    vcpu.blocked_at = now;
    if (running_ == slots_[id]) running_ = kNoSlot;
}

void CoreScheduler::charge(VcpuId id, Nanoseconds cost, Instant now) {
    account(now);
    Vcpu& vcpu = at(id);
    if (!vcpu.owns_core) vcpu.server.consume(now, cost);
}

void CoreScheduler::wait_for_lock(VcpuId id, bool waits, Instant now) {
    account(now);
    at(id).waits_for_lock = waits;
    if (waits && running_ == slots_[id]) running_ = kNoSlot;
}

void CoreScheduler::inherit(VcpuId id, Rank rank) {
    Vcpu& vcpu = at(id);
    if (vcpu.inherited == Rank{})
        vcpu.grace = vcpu.overrun > Nanoseconds{0} ? vcpu.overrun : vcpu.server.parameters().budget;
    vcpu.inherited = rank;
}

void CoreScheduler::account(Instant now, Nanoseconds stolen) {
    QDUINO_EXPECT(now >= accounted_until_);
    if (running_ != kNoSlot) {
        const Nanoseconds used = now - accounted_until_ - stolen;
        QDUINO_EXPECT(stolen >= Nanoseconds{0} && used >= Nanoseconds{0});
        Vcpu& pays = vcpus_[paying_];
        if (pays.owns_core)
            pays.owned_consumed += used;
        else if (used > Nanoseconds{0})
            pays.grace -= std::min(pays.grace, pays.server.consume(now, used));
    }
    accounted_until_ = now;
}

// ---- the decision -------------------------------------------------------------------------------

Decision CoreScheduler::decide(Instant now) {
    account(now);
    const Vcpu* chosen = highest(now);
    const Instant until = next_change(chosen, now);
    running_ = chosen ? slots_[chosen->id] : kNoSlot;
    if (!chosen) return {std::nullopt, until};
    paying_ = slots_[payer(*chosen, now).id];
    return {chosen->id, until};
}

const CoreScheduler::Vcpu* CoreScheduler::highest(Instant now) const {
    const Vcpu* best = nullptr;
    for (const Vcpu& vcpu : vcpus_) {
        if (!is_ready(vcpu) || available(vcpu, now) == Nanoseconds{0}) continue;
        if (!best || rank_of(vcpu, now) < rank_of(*best, now)) best = &vcpu;
    }
    return best;
}

/// The end of the budget that the chosen VCPU runs on. Earlier, if a VCPU that has none is
/// replenished before that and may then preempt it, or is one that pays for another's run.
Instant CoreScheduler::next_change(const Vcpu* chosen, Instant now) const {
    Instant until = kForever;
    if (chosen && !chosen->owns_core) until = now + available(*chosen, now);
    for (const Vcpu& vcpu : vcpus_) {
        if (!is_ready(vcpu) || vcpu.owns_core || vcpu.server.available(now) > Nanoseconds{0}) continue;
        if (chosen && rank_of(*chosen, now) < std::min(own_rank(vcpu), vcpu.inherited)) continue;
        until = std::min(until, vcpu.server.next_replenishment());
        const Vcpu& pays = payer(vcpu, now);
        if (pays.server.available(now) == Nanoseconds{0})
            until = std::min(until, pays.server.next_replenishment());
    }
    return until;
}

// ---- queries ------------------------------------------------------------------------------------

std::optional<VcpuId> CoreScheduler::running() const {
    if (running_ == kNoSlot) return std::nullopt;
    return vcpus_[running_].id;
}

Nanoseconds CoreScheduler::available(VcpuId id, Instant now) const { return available(at(id), now); }

Instant CoreScheduler::next_replenishment(VcpuId id) const { return at(id).server.next_replenishment(); }

Nanoseconds CoreScheduler::consumed(VcpuId id) const {
    const Vcpu& vcpu = at(id);
    return vcpu.owns_core ? vcpu.owned_consumed : vcpu.server.consumed();
}

}  // namespace qduino::sched
