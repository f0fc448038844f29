// Locks between VCPUs, with exact priority inheritance across cores and through chains of locks.
//
//   high              lock ░░░░██ unlock             ░ waits: low ranks as high until it unlocks
//   mid        ████               ████████
//   low   lock██          ████ unlock           ██
//
// The word holds the number of its holder. Without contention both ways are one compare-and-swap.
// With it, one spin lock guards who waits for what, and the ranks that follow from that; each core
// is told by mail what its own threads inherit. unlock() hands the lock over: a waiter never
// retries. What a holder without budget runs on is the scheduler's (sched/core_scheduler.h).
#pragma once

#include "board/metal/computer/spin_lock.h"
#include "board/metal/core/thread.h"
#include "board/types.h"

namespace qduino::board::metal {

class Locks {
  public:
    // As board.h has them:
    void lock(LockWord& word);
    [[nodiscard]] bool try_lock(LockWord& word);
    void unlock(LockWord& word);

    /// What `thread` inherits; Rank{}: nothing.
    [[nodiscard]] sched::Rank inherited_by(const Thread& thread);

  private:
    [[nodiscard]] bool wait(LockWord& word, Thread& self);
    [[nodiscard]] static Thread* holder_of(const LockWord& word);
    [[nodiscard]] static Thread* first_waiter_for(const LockWord& word);
    [[nodiscard]] static bool closes_a_cycle(const LockWord& word, const Thread& self);
    static void renew_ranks();

    SpinLock lock_;
};

inline constinit Locks locks;

}  // namespace qduino::board::metal
