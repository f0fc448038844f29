// Locks between simulated VCPUs: exact priority inheritance, and the budget of a VCPU that holds
// one.
//
//   high              lock ░░░░██ unlock             ░ waits: low ranks as high until it unlocks
//   mid        ████████               ████████
//   low   lock██          ████ unlock           ██
//
// A waiter sleeps until unlock() hands the lock over. It never retries, so its wait is the rest of
// the critical section and nothing else. Ranks follow chains of locks (renew_ranks()) and cross
// cores, as SCHED_FIFO priorities do.
#pragma once

#include "board/sim/event_loop.h"

namespace qduino::board::sim {

class SimLocks {
  public:
    /// `loop` outlives it.
    explicit SimLocks(EventLoop& loop) : loop_(loop) {}

    // As board.h has them:
    void lock(LockWord& word);
    [[nodiscard]] bool try_lock(LockWord& word);
    void unlock(LockWord& word);

  private:
    [[nodiscard]] std::uint32_t own_value() const;
    [[nodiscard]] bool take(LockWord& word);
    [[nodiscard]] Vcpu* holder_of(const LockWord& word) const;
    [[nodiscard]] Vcpu* first_waiter_for(const LockWord& word) const;
    [[nodiscard]] bool closes_a_cycle(const LockWord& word) const;
    void renew_ranks();

    EventLoop& loop_;
};

}  // namespace qduino::board::sim
