// Locks between loops on stock Linux: the kernel's priority-inheriting futexes (futex(2);
// Documentation/locking/pi-futex.rst).
//
//   free, nobody waits    one compare-and-swap each way, in user space
//   held                  FUTEX_LOCK_PI: the kernel lends the holder the waiter's priority, through
//                         chains, until unlock
//
// The wait is announced to the budget, so that it costs none; the hold is, so that the holder is
// not put to sleep for its budget while others wait for it (budget_keeper.h). It works as well
// between threads without SCHED_FIFO, where it orders nothing and excludes all the same.
#pragma once

#include "board/types.h"

namespace qduino::board::linux {

// As board.h has them, for the calling thread.
void take_lock(LockWord& word);
[[nodiscard]] bool try_to_take_lock(LockWord& word);
void give_lock(LockWord& word);

}  // namespace qduino::board::linux
