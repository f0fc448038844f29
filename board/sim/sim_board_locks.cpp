// Locks between simulated VCPUs: exact priority inheritance, and the budget of who holds one.
//
//   high              lock ░░░░██ unlock                 ░ waits: low ranks as high until it unlocks
//   mid        ████████               ████████
//   low   lock██          ████ unlock           ██
//
// A waiter sleeps until unlock() hands the lock over: it never retries, so its wait is the rest of the critical section and
// nothing else. Ranks follow chains of locks (renew_ranks()) and cross cores, as SCHED_FIFO priorities do.
#include <algorithm>

#include "base/contract.h"
#include "board/sim/sim_board.h"

namespace qduino::board::sim {

std::uint32_t SimBoard::lock_value() const { return std::uint32_t{current_vcpu()} + 1; }

Vcpu* SimBoard::holder_of(const LockWord& word) const {
    const std::uint32_t value = word.value.load(std::memory_order_relaxed);
    return value == 0 ? nullptr : vcpus_[value - 1].get();  // null as well for setup()
}

void SimBoard::count_lock(Vcpu& vcpu, int change) {
    vcpu.locks_held += change;
    vcpu.core->set_holding(vcpu, vcpu.locks_held > 0, now_);
}

bool SimBoard::take(LockWord& word) {
    if (word.value.load(std::memory_order_relaxed) != 0) return false;
    word.value.store(lock_value(), std::memory_order_relaxed);
    if (current_) count_lock(*current_, 1);
    return true;
}

bool SimBoard::try_lock(LockWord& word) {
    charge(ApiCall::lock);
    return take(word);
}

void SimBoard::lock(LockWord& word) {
    charge(ApiCall::lock);
    if (take(word)) return;
    QDUINO_EXPECT(current_ != nullptr);  // setup() is alone: what it holds it has locked itself
    QDUINO_EXPECT(!closes_a_cycle(word));
    polls_ = 0;
    current_->waits_for = &word;
    current_->state = VcpuState::sleeping;
    current_->wake = kForever;
    renew_ranks();
    current_->fiber->suspend();  // until unlock() has handed it over
}

void SimBoard::unlock(LockWord& word) {
    charge(ApiCall::lock);
    QDUINO_EXPECT(word.value.load(std::memory_order_relaxed) == lock_value());
    Vcpu* const next = first_waiter_for(word);
    word.value.store(next ? std::uint32_t{next->spec.id} + 1 : 0, std::memory_order_relaxed);
    if (current_) {
        count_lock(*current_, -1);
        if (!current_core_->has_budget(*current_, now_)) horizon_ = now_;  // it overran, and is stopped here
    }
    if (!next) return;
    next->waits_for = nullptr;
    next->wake = now_;
    next->handed_lock = true;
    count_lock(*next, 1);
    renew_ranks();
    horizon_ = now_;  // whoever runs looks up before it takes more time
}

Vcpu* SimBoard::first_waiter_for(const LockWord& word) const {
    Vcpu* first = nullptr;
    for (const auto& vcpu : vcpus_) {
        if (vcpu && vcpu->waits_for == &word && (!first || vcpu->rank < first->rank)) first = vcpu.get();
    }
    return first;
}

bool SimBoard::closes_a_cycle(const LockWord& word) const {
    const Vcpu* holder = holder_of(word);
    while (holder && holder != current_ && holder->waits_for) holder = holder_of(*holder->waits_for);
    return holder == current_;
}

/// Everybody's rank anew: its own, raised along each wait until nothing changes (as often as chains are long).
void SimBoard::renew_ranks() {
    for (const auto& vcpu : vcpus_) {
        if (vcpu) vcpu->rank = {vcpu->spec.period, vcpu->spec.id};
    }
    for (bool changed = true; changed;) {
        changed = false;
        for (const auto& vcpu : vcpus_) {
            Vcpu* const holder = vcpu && vcpu->waits_for ? holder_of(*vcpu->waits_for) : nullptr;
            if (!holder || holder->rank <= vcpu->rank) continue;
            holder->rank = vcpu->rank;
            changed = true;
        }
    }
    for (const auto& vcpu : vcpus_) {
        if (vcpu) vcpu->core->inherit(*vcpu, now_);
    }
}

}  // namespace qduino::board::sim
