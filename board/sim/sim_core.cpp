#include "board/sim/sim_core.h"

#include <utility>

#include "base/contract.h"
#include "board/sim/event_loop.h"

namespace qduino::board::sim {

bool SimCore::add(Vcpu& vcpu, Instant now) {
    const VcpuSpec& spec = vcpu.spec;
    // A bottom half takes the core for the switch to it and for the one back. Its edges' top halves
    // are counted for themselves.
    const bool added = spec.is_io()
                           ? scheduler_.add_io(spec.id, spec.parameters(), now,
                                               {.activation = 2 * config_.costs.context_switch,
                                                .client_period = spec.client_period,
                                                .overrun = spec.overrun})
                           : scheduler_.add(spec.id, {spec.budget + spec.allowance, spec.period}, now,
                                            {.owns_core = spec.owns_core, .deferrable = spec.deferrable});
    if (!added) return false;
    vcpu.core = this;
    const auto place = std::find_if(vcpus_.begin(), vcpus_.end(),
                                    [&](const Vcpu* other) { return other->spec.id > vcpu.spec.id; });
    vcpus_.insert(place, &vcpu);
    accounted_ = now;
    settle_soon(now);
    return true;
}

const Vcpu* SimCore::owner() const {
    return vcpus_.size() == 1 && vcpus_.front()->spec.owns_core ? vcpus_.front() : nullptr;
}

Vcpu* SimCore::find(VcpuId id) const {
    const auto found =
        std::find_if(vcpus_.begin(), vcpus_.end(), [&](const Vcpu* vcpu) { return vcpu->spec.id == id; });
    QDUINO_EXPECT(found != vcpus_.end());
    return *found;
}

void SimCore::interrupt(Instant now, Nanoseconds cost) {
    steal(now, cost);
    if (config_.charge_interrupts_to_victim) to_be_paid_ += cost;
}

void SimCore::steal(Instant now, Nanoseconds cost) {
    if (cost <= Nanoseconds{0}) return;
    account(now);
    const Instant from = std::max(stolen_until_, now);
    stolen_until_ = from + cost;
    stolen_total_ += cost;
    loop_.tell_taken(number_, from, stolen_until_);
    static_cast<void>(interrupted(now));
}

void SimCore::account(Instant now) {
    if (now <= accounted_) return;
    const Nanoseconds passed = now - accounted_;
    const Nanoseconds stolen = std::clamp(stolen_until_ - accounted_, Nanoseconds{0}, passed);
    const Nanoseconds paid = paid_of(stolen);
    scheduler_.account(now, stolen - paid);
    to_be_paid_ -= paid;
    if (running_) running_->work_left = std::max(running_->work_left - (passed - stolen), Nanoseconds{0});
    accounted_ = now;
}

Nanoseconds SimCore::running_time(Instant now) const {
    const Nanoseconds passed = std::max(now - accounted_, Nanoseconds{0});
    const Nanoseconds stolen = std::clamp(stolen_until_ - accounted_, Nanoseconds{0}, passed);
    return scheduler_.consumed(running_->spec.id) + passed - stolen + paid_of(stolen);
}

Nanoseconds SimCore::busy_total() const {
    Nanoseconds total{0};
    for (const Vcpu* vcpu : vcpus_) total += cpu_time(vcpu->spec.id);
    return total;
}

void SimCore::give_up(Vcpu& vcpu, Instant now) {
    account(now);
    if (vcpu.waits_for)
        scheduler_.wait_for_lock(vcpu.spec.id, true, now);
    else
        scheduler_.block(vcpu.spec.id, now);
    loop_.emit(number_, vcpu.spec.id,
               vcpu.state == VcpuState::finished ? TraceKind::finish : TraceKind::block);
    running_ = nullptr;
    ready_ = false;
    settle_soon(now);
}

void SimCore::release(Vcpu& vcpu, Instant nominal, Instant now) {
    vcpu.turns.release(vcpu.spec, vcpu.spec.requests);
    if (!vcpu.spec.deferrable) return;
    account(now);
    scheduler_.release(vcpu.spec.id, nominal, now);
    settle_soon(now);
}

void SimCore::work_came(Vcpu& io, Nanoseconds client_period, Instant now) {
    if (io.state == VcpuState::sleeping && io.wake == kForever && !io.waits_for) {
        io.client_period = client_period;
        io.wake = now;
    } else if (client_period > Nanoseconds{0} && io.state == VcpuState::ready) {
        account(now);
        scheduler_.wake_io(io.spec.id, now, client_period);  // which may raise it
    }
    settle_soon(now);
}

void SimCore::change_io(Vcpu& io, sched::VcpuParameters parameters, Instant now) {
    account(now);
    scheduler_.change_io(io.spec.id, parameters, now);
    io.spec.budget = parameters.budget;
    io.spec.period = parameters.period;
    settle_soon(now);
}

void SimCore::inherit(const Vcpu& vcpu, Instant now) {
    scheduler_.inherit(vcpu.spec.id, vcpu.inherited);
    settle_soon(now);
}

bool SimCore::interrupted(Instant now) {
    if (stolen_until_ <= now) return false;
    ready_ = false;
    done_at_ = kForever;
    disturbed_at_ = stolen_until_;
    return true;
}

void SimCore::settle(Instant now) {
    account(now);
    if (interrupted(now)) return;  // decided when the interrupt is over
    if (!running_ || running_->done_at(now) > now) return decide(now);
    // What else is due here stays due: the code's next wish for time comes back to decide().
    ready_ = true;
}

void SimCore::decide(Instant now) {
    account(now);
    if (interrupted(now)) return;
    wake_sleepers(now);
    const sched::Decision decision = scheduler_.decide(now);
    turn_to(decision.vcpu ? find(*decision.vcpu) : nullptr, now);
    trace_throttling(now);
    if (interrupted(now)) return;  // turning to it cost time

    done_at_ = running_ ? running_->done_at(now) : kForever;
    ready_ = done_at_ <= now;
    disturbed_at_ = decision.until;
    for (const Vcpu* vcpu : vcpus_) {
        if (vcpu->state == VcpuState::sleeping) disturbed_at_ = std::min(disturbed_at_, vcpu->wake);
    }
}

void SimCore::wake_sleepers(Instant now) {
    for (Vcpu* vcpu : vcpus_) {
        if (vcpu->state != VcpuState::sleeping || vcpu->wake > now) continue;
        vcpu->state = VcpuState::ready;
        loop_.tell_ready(number_, vcpu->spec.id);
        if (std::exchange(vcpu->handed_lock, false)) {
            scheduler_.wait_for_lock(vcpu->spec.id, false, now);
            pay_for_lock(*vcpu, now);
            continue;
        }
        // Before it wakes: a server that has work takes what it pays for time that it ran just now.
        pay_for_wake(*vcpu, now);
        if (vcpu->client_period > Nanoseconds{0})
            scheduler_.wake_io(vcpu->spec.id, now, vcpu->client_period);
        else
            scheduler_.wake(vcpu->spec.id, now, vcpu->wake);
        if (vcpu->has_fault) apply_faults(*vcpu, now);
        if (vcpu->spec.is_io()) loop_.emit(number_, vcpu->spec.id, TraceKind::release);
    }
}

void SimCore::pay_for_wake(Vcpu& vcpu, Instant now) {
    if (vcpu.spec.is_io()) return;  // its service pays
    if (!vcpu.turns.counts_wake(vcpu.spec, vcpu.wake - config_.wake_latency)) pay(vcpu, now);
}

void SimCore::pay_for_throttling(Vcpu& vcpu, Instant now) {
    if (vcpu.spec.is_io() || vcpu.waits_for) return;
    if (!vcpu.turns.counts_pause(vcpu.spec, scheduler_.next_replenishment(vcpu.spec.id))) pay(vcpu, now);
}

/// Each loop's R has the turns that its declared requests take. A handler has declared none: its
/// activation is one turn, and the one behind a wait is another.
void SimCore::pay_for_lock(Vcpu& vcpu, Instant now) {
    if (!vcpu.turns.counts_wait()) pay(vcpu, now);
}

/// The switch to it, and the one back to what it displaces. Alone on its core it displaces nothing.
void SimCore::pay(const Vcpu& vcpu, Instant now) {
    if (config_.costs.context_switch > Nanoseconds{0} && vcpus_.size() > 1)
        scheduler_.charge(vcpu.spec.id, 2 * config_.costs.context_switch, now);
}

/// What a loop's release takes too much, in the time of its fault.
void SimCore::apply_faults(Vcpu& vcpu, Instant now) const {
    for (const LoopFault& fault : config_.loop_faults) {
        if (fault.loop == vcpu.spec.id && fault.from <= now && now < fault.until)
            vcpu.work_left += fault.extra;
    }
}

void SimCore::turn_to(Vcpu* next, Instant now) {
    if (next == running_) return;
    if (running_ && scheduler_.available(running_->spec.id, now) > Nanoseconds{0}) {
        loop_.emit(number_, running_->spec.id, TraceKind::preempt);
    }
    running_ = next;
    if (!running_) return;
    loop_.emit(number_, running_->spec.id, TraceKind::run);
    tally_.switches.add(config_.costs.context_switch);
    steal(now, config_.costs.context_switch);
}

void SimCore::trace_throttling(Instant now) {
    for (Vcpu* vcpu : vcpus_) {
        const bool throttled =
            vcpu->state == VcpuState::ready && scheduler_.available(vcpu->spec.id, now) == Nanoseconds{0};
        if (throttled == vcpu->throttled) continue;
        vcpu->throttled = throttled;
        if (throttled) pay_for_throttling(*vcpu, now);
        loop_.emit(number_, vcpu->spec.id, throttled ? TraceKind::throttle : TraceKind::replenish);
    }
}

}  // namespace qduino::board::sim
