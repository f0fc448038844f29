// Waits for locks that loops of other cores hold: how long they last, and whom they delay.
//
//   core 0   loop 1   ████ lock A ░░░░░░░░░░░░░░░░░░░░░████       ░ waits
//   core 1   loop 2         (lock A) ██▒▒▒▒▒▒▒▒▒▒▒██ unlock A     ▒ loop 3 runs: it ranks above
//            loop 3                    ███████████                  loop 1, and so above the holder
//
// The analysis of one core (blocking.h) knows none of that: while a loop waits for another core,
// its own core runs lower loops, which may take locks meanwhile; and a holder is held up by what
// its own core has above it. The bound here is simple and generous. It looks at each instant of a
// wait. At the end of the chain of holders is one that waits for no lock, and it has the rank of
// the waiter i or a higher one. So its core m runs it, or what ranks higher: always something of
// this list.
//
//   H_m(i, w)   what core m executes in any window of length w, of
//               - loops above i and above the lowest holder on m: all that they execute
//               - other loops of m: what they execute with a lock, for they may be lifted above i
//               - bottom halves for clients up to T_i, and the platform
//               Where the group has one lock, loops below i execute with it once, one of them: who
//               has it when the wait begins. It goes to the highest waiter next.
//   W_i         the least w > Σ_m H_m(i, w), over the cores m of the holders
//   each wait   ends after W_i; for Σ H_m(i, W_i) of it, over the other cores, core(i) has no part
//
// A window begins anywhere, so what was released before it may run in it. A loop that executes `a`
// in a release and ends it within E counts with ⌈(w + E − a)/T⌉·a. E is its R where it waits for no
// other core and has a sporadic server; else its period T. A bottom half counts one service more,
// which may be late, and the platform one event more.
//
// Three more things follow for the core of the waiter:
// - A loop that waits for other cores may use its budget late in one period and early in the next.
//   It counts, and is served, as a deferrable server (deferrable_server.h).
// - Lower loops of its core may lock something during each wait: blocking counts once more for
//   each.
// - A lower loop of any core is lifted by waiters elsewhere. It delays those in between by what it
//   executes with locks, once at each release and after each wait or sleep, and in two of its own
//   releases at most.
//
// Which loops: those that locks connect. A loop that takes two locks connects them. Where such a
// group is on one core, nothing here applies to it.
//
// That all waits end in time is part of the assumption that each release ends within its period,
// and of the conclusion. As in any such analysis, the first release that did not would contradict
// the bound. Rank order, inheritance across cores and one hand-over to the highest waiter are the
// board's contract (board/board.h, "Locks").
//
// R. Rajkumar, "Real-time synchronization protocols for shared memory multiprocessors", ICDCS 1990,
// names remote blocking, the preemption of remote holders, and the blocking after each suspension.
// That protocol has priority ceilings for holders; inheritance has none, hence the higher loops in
// H. Suspension as jitter: J.-J. Chen et al., Real-Time Systems, 2019.
#pragma once

#include <span>

#include "sched/load.h"

namespace qduino::sched {

/// Is any lock shared between loops of different loads? A section of no length is none.
[[nodiscard]] bool locks_cross_cores(std::span<const CoreLoad> loads);

/// Fills CoreLoad::waits of each of `loads`, which are all cores of the computer. A wait that has
/// no bound within the waiter's period has one beyond kResponseLimit of them. Setup-time. Contract:
/// valid parameters, at most 128 loops.
void count_remote_waits(std::span<CoreLoad> loads);

/// The loops that share locks with `loop` across cores, itself not among them.
[[nodiscard]] FixedVector<VcpuId, kMainVcpuLimit> remote_sharers(std::span<const CoreLoad> loads,
                                                                 VcpuId loop);

}  // namespace qduino::sched
