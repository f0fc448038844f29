// Finds the real-time task of another process that kept a loop from its core.
//
// A task can run in front of a loop, on its core, if it has SCHED_FIFO or SCHED_RR at the loop's
// priority or a higher one, or SCHED_DEADLINE. The search reads /proc/PID/task/TID/stat twice, a
// short while apart. It names a task that could run both times, or whose CPU time grew by more than
// one tick. (Source: proc_pid_stat(5); sched(7) for the order of priorities.)
//
// Reads /proc for some milliseconds and sleeps in between: never from a real-time thread.
#pragma once

#include <sys/types.h>

#include <functional>
#include <optional>
#include <string>

#include "base/time.h"
#include "board/window/pins_layout.h"

namespace qduino::board::linux {

struct CoreRival {
    pid_t pid = 0;
    pid_t tid = 0;
    std::string name;   ///< of the task, 15 bytes at most
    int policy = 0;     ///< SCHED_FIFO, SCHED_RR or SCHED_DEADLINE
    int priority = 0;   ///< 1…99; 0 with SCHED_DEADLINE
    Nanoseconds ran{};  ///< CPU time between the two looks, in ticks of 10 ms
};

struct RivalSearch {
    int core = 0;
    int priority = 1;            ///< of the loop; a task with less cannot keep it waiting
    pid_t not_of = 0;            ///< the sketch; the caller's own process is left out too
    std::string root;            ///< precedes /proc (tests)
    std::function<void()> wait;  ///< between the two looks; empty: sleeps 50 ms
};

/// The task that ran most; nothing when none did.
[[nodiscard]] std::optional<CoreRival> find_core_rival(const RivalSearch& search);

/// A task of another process than `not_of` that leaves core `core` to nobody: SCHED_FIFO, SCHED_RR
/// or SCHED_DEADLINE, and it ran nearly all the time between two looks. "stress-ng (pid 4711,
/// SCHED_FIFO 85)"; empty: there is none. Takes 50 ms where such a task is on that core, and 150 ms
/// where others are.
[[nodiscard]] std::string who_spins_on(int core, pid_t not_of, const std::string& root = "");

/// For the end of a sentence about loop `vcpu` of the sketch `sketch` on these pins: "core 1 was
/// taken by stress-ng (pid 4711, SCHED_FIFO 85)". Empty when the loop has not published its place,
/// or when no such task is found.
[[nodiscard]] std::string who_took_the_core_of(board::VcpuId vcpu, const PinsLayout& layout, pid_t sketch,
                                               const std::string& root = "");

/// The same for the first core of that sketch's loops that such a task has.
[[nodiscard]] std::string who_took_a_core_of(const PinsLayout& layout, pid_t sketch,
                                             const std::string& root = "");

}  // namespace qduino::board::linux
