#include "board/sim/sim_locks.h"

#include "base/contract.h"

namespace qduino::board::sim {

std::uint32_t SimLocks::own_value() const {
    const Vcpu* const self = loop_.current();
    return std::uint32_t{self ? self->spec.id : kNoVcpu} + 1;
}

Vcpu* SimLocks::holder_of(const LockWord& word) const {
    const std::uint32_t value = word.value.load(std::memory_order_relaxed);
    // Null as well for setup().
    return value == 0 ? nullptr : loop_.cpus().vcpu(static_cast<VcpuId>(value - 1));
}

bool SimLocks::take(LockWord& word) {
    if (word.value.load(std::memory_order_relaxed) != 0) return false;
    word.value.store(own_value(), std::memory_order_relaxed);
    return true;
}

bool SimLocks::try_lock(LockWord& word) {
    loop_.charge(ApiCall::lock);
    return take(word);
}

void SimLocks::lock(LockWord& word) {
    loop_.charge(ApiCall::lock);
    if (take(word)) return;
    Vcpu* const self = loop_.current();
    QDUINO_EXPECT(self != nullptr);  // setup() is alone: what it holds it has locked itself
    QDUINO_EXPECT(!closes_a_cycle(word));
    self->waits_for = &word;
    self->state = VcpuState::sleeping;
    self->wake = kForever;
    renew_ranks();
    loop_.wait();  // until unlock() has handed it over
}

void SimLocks::unlock(LockWord& word) {
    loop_.charge(ApiCall::lock);
    QDUINO_EXPECT(word.value.load(std::memory_order_relaxed) == own_value());
    Vcpu* const next = first_waiter_for(word);
    word.value.store(next ? std::uint32_t{next->spec.id} + 1 : 0, std::memory_order_relaxed);
    if (!next) return;
    next->waits_for = nullptr;
    next->wake = loop_.now();
    next->handed_lock = true;
    renew_ranks();
    loop_.look_up();
}

Vcpu* SimLocks::first_waiter_for(const LockWord& word) const {
    Vcpu* first = nullptr;
    loop_.cpus().each([&](Vcpu& vcpu) {
        if (vcpu.waits_for == &word && (!first || vcpu.rank < first->rank)) first = &vcpu;
    });
    return first;
}

bool SimLocks::closes_a_cycle(const LockWord& word) const {
    const Vcpu* holder = holder_of(word);
    while (holder && holder != loop_.current() && holder->waits_for) holder = holder_of(*holder->waits_for);
    return holder == loop_.current();
}

/// Everybody's rank anew: its own, raised along each wait until nothing changes (as often as chains
/// are long).
void SimLocks::renew_ranks() {
    const SimCpus& cpus = loop_.cpus();
    cpus.each([](Vcpu& vcpu) {
        vcpu.rank = {vcpu.spec.period, vcpu.spec.id};
        vcpu.inherited = {};
    });
    for (bool changed = true; changed;) {
        changed = false;
        cpus.each([&](Vcpu& vcpu) {
            Vcpu* const holder = vcpu.waits_for ? holder_of(*vcpu.waits_for) : nullptr;
            if (!holder || holder->inherited <= vcpu.rank) return;
            holder->inherited = vcpu.rank;
            holder->rank = std::min(holder->rank, vcpu.rank);
            changed = true;
        });
    }
    cpus.each([&](Vcpu& vcpu) { vcpu.core->inherit(vcpu, loop_.now()); });
}

}  // namespace qduino::board::sim
