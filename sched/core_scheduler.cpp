#include "sched/core_scheduler.h"

#include <algorithm>

#include "base/contract.h"

namespace qduino::sched {

CoreScheduler::CoreScheduler() { slots_.fill(kNoSlot); }

// ---- the table ----------------------------------------------------------------------------------

bool CoreScheduler::add(VcpuId id, VcpuParameters parameters, Instant now, MainVcpuOptions options) {
    if (!parameters.valid() || contains(id) || main_count_ == kMainVcpuLimit) return false;
    if (options.owns_core && !parameters.whole_core()) return false;
    Vcpu vcpu;
    vcpu.id = id;
    vcpu.owns_core = options.owns_core;
    vcpu.server = SporadicServer{parameters, now, options.server};
    insert(vcpu);
    ++main_count_;
    return true;
}

bool CoreScheduler::add_io(VcpuId id, VcpuParameters parameters, Instant now) {
    if (!parameters.valid() || contains(id) || io_count_ == kIoVcpuLimit) return false;
    Vcpu vcpu;
    vcpu.id = id;
    vcpu.server = Pibs{parameters, now};
    insert(vcpu);
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

Rank CoreScheduler::rank_of(const Vcpu& vcpu) {
    return std::min(Rank{vcpu.server.rank_period(), vcpu.id}, vcpu.inherited);
}

bool CoreScheduler::before(const Vcpu& a, const Vcpu& b) { return rank_of(a) < rank_of(b); }

Nanoseconds CoreScheduler::available(const Vcpu& vcpu, Instant now) {
    if (vcpu.owns_core) return Nanoseconds::max();
    const Nanoseconds left = vcpu.server.available(now);
    return left > Nanoseconds{0} || !vcpu.holding ? left : vcpu.grace;
}

void CoreScheduler::charge(Vcpu& vcpu, Instant now, Nanoseconds used) {
    if (vcpu.owns_core) {
        vcpu.owned_consumed += used;
        return;
    }
    vcpu.grace -= std::min(vcpu.grace, vcpu.server.consume(now, used));
}

// ---- events -------------------------------------------------------------------------------------

void CoreScheduler::wake(VcpuId id, Instant now) {
    account(now);
    at(id).server.wake(now);
}

void CoreScheduler::wake_io(VcpuId id, Instant now, Nanoseconds client_period) {
    account(now);
    at(id).server.wake_for(now, client_period);
}

void CoreScheduler::wake_io_for(VcpuId id, VcpuId client, Instant now) {
    QDUINO_EXPECT(!at(client).server.is_io());
    wake_io(id, now, at(client).server.parameters().period);
}

void CoreScheduler::block(VcpuId id, Instant now) {
    account(now);
    at(id).server.block(now);
    if (running_ == slots_[id]) running_ = kNoSlot;
}

void CoreScheduler::inherit(VcpuId id, Rank rank) { at(id).inherited = rank; }

void CoreScheduler::set_holding(VcpuId id, bool holding, Instant now) {
    account(now);
    Vcpu& vcpu = at(id);
    if (holding == vcpu.holding) return;
    vcpu.holding = holding;
    vcpu.grace = holding ? vcpu.server.parameters().budget : Nanoseconds{0};
}

void CoreScheduler::account(Instant now, Nanoseconds stolen) {
    QDUINO_EXPECT(now >= accounted_until_);
    if (running_ != kNoSlot) {
        const Nanoseconds used = now - accounted_until_ - stolen;
        QDUINO_EXPECT(stolen >= Nanoseconds{0} && used >= Nanoseconds{0});
        if (used > Nanoseconds{0}) charge(vcpus_[running_], now, used);
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
    return {chosen->id, until};
}

const CoreScheduler::Vcpu* CoreScheduler::highest(Instant now) const {
    const Vcpu* best = nullptr;
    for (const Vcpu& vcpu : vcpus_) {
        if (!vcpu.server.has_work() || available(vcpu, now) == Nanoseconds{0}) continue;
        if (!best || before(vcpu, *best)) best = &vcpu;
    }
    return best;
}

/// The end of the chosen VCPU's budget. Earlier, if a throttled VCPU that would preempt it is
/// replenished before that.
Instant CoreScheduler::next_change(const Vcpu* chosen, Instant now) const {
    Instant until = kForever;
    if (chosen && !chosen->owns_core) until = now + available(*chosen, now);
    for (const Vcpu& vcpu : vcpus_) {
        const bool throttled = vcpu.server.has_work() && available(vcpu, now) == Nanoseconds{0};
        if (throttled && (!chosen || before(vcpu, *chosen))) {
            until = std::min(until, vcpu.server.next_replenishment());
        }
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
