#include "board/metal/core/locks.h"

#include <algorithm>

#include "base/contract.h"
#include "board/metal/core/kernel.h"

namespace qduino::board::metal {
namespace {

constexpr std::uint32_t kFree = 0;
constexpr std::uint32_t kWaiters = 1u << 16;  // somebody waits: unlock() must look

std::uint32_t value_of(VcpuId holder) { return std::uint32_t{holder} + 1; }

}  // namespace

bool Locks::try_lock(LockWord& word) {
    std::uint32_t expected = kFree;
    return word.value.compare_exchange_strong(expected, value_of(running_vcpu()), std::memory_order_acquire);
}

void Locks::lock(LockWord& word) {
    if (try_lock(word)) return;
    Thread* const self = this_core().running();
    QDUINO_EXPECT(self != nullptr);  // setup() is alone: what it holds it has locked itself
    const InterruptsOff off;
    if (wait(word, *self)) this_core().wait_for_lock();
}

/// False: it was given back meanwhile, and is the caller's.
bool Locks::wait(LockWord& word, Thread& self) {
    const SpinGuard held(lock_);
    for (std::uint32_t value = word.value.load();;) {
        const std::uint32_t next = value == kFree ? value_of(self.spec.id) : value | kWaiters;
        if (!word.value.compare_exchange_weak(value, next, std::memory_order_acquire)) continue;
        if (value == kFree) return false;
        break;
    }
    QDUINO_EXPECT(!closes_a_cycle(word, self));
    self.waits_for = &word;
    renew_ranks();
    return true;
}

void Locks::unlock(LockWord& word) {
    std::uint32_t value = value_of(running_vcpu());
    if (word.value.compare_exchange_strong(value, kFree, std::memory_order_release)) return;
    QDUINO_EXPECT(value == (value_of(running_vcpu()) | kWaiters));
    const InterruptsOff off;
    {
        const SpinGuard held(lock_);
        Thread* const next = first_waiter_for(word);
        next->waits_for = nullptr;
        word.value.store(value_of(next->spec.id) | (first_waiter_for(word) ? kWaiters : 0),
                         std::memory_order_release);
        renew_ranks();
        core_of(*next).mail().locks.post(next->spec.id);
        if (&core_of(*next) != &this_core()) core_of(*next).call();
    }
    Core::look_up();  // it may rank above the caller, which has lost what it inherited
}

Thread* Locks::holder_of(const LockWord& word) {
    const std::uint32_t value = word.value.load() & (kWaiters - 1);
    return value <= value_of(kNoVcpu) ? nullptr : &threads[value - 1];
}

Thread* Locks::first_waiter_for(const LockWord& word) {
    Thread* first = nullptr;
    for (Thread& thread : threads) {
        if (thread.waits_for == &word && (!first || thread.rank < first->rank)) first = &thread;
    }
    return first;
}

bool Locks::closes_a_cycle(const LockWord& word, const Thread& self) {
    const Thread* holder = holder_of(word);
    while (holder && holder != &self && holder->waits_for) holder = holder_of(*holder->waits_for);
    return holder == &self;
}

/// Everybody's rank anew: its own, raised along each wait until nothing changes (as often as chains
/// are long). Whose inheritance has changed is told to its core.
void Locks::renew_ranks() {
    std::array<sched::Rank, kVcpuLimit> before;
    for (std::size_t i = 0; i < threads.size(); ++i) {
        Thread& thread = threads[i];
        before[i] = thread.inherited;
        thread.rank = {thread.spec.period, thread.spec.id};
        thread.inherited = {};
    }
    for (bool changed = true; changed;) {
        changed = false;
        for (const Thread& thread : threads) {
            Thread* const holder = thread.waits_for ? holder_of(*thread.waits_for) : nullptr;
            if (!holder || holder->inherited <= thread.rank) continue;
            holder->inherited = thread.rank;
            holder->rank = std::min(holder->rank, thread.rank);
            changed = true;
        }
    }
    for (std::size_t i = 0; i < threads.size(); ++i) {
        if (threads[i].inherited == before[i]) continue;
        core_of(threads[i]).mail().ranks.post(static_cast<VcpuId>(i));
        if (&core_of(threads[i]) != &this_core()) core_of(threads[i]).call();
    }
}

sched::Rank Locks::inherited_by(const Thread& thread) {
    const SpinGuard held(lock_);
    return thread.inherited;
}

}  // namespace qduino::board::metal
