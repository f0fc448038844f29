// Who took a core from a loop: the real-time task of another process that ran there instead.
//
// Above a loop, on its core, may run whoever has SCHED_FIFO or SCHED_RR at its priority or a higher one, or SCHED_DEADLINE. Such a task
// is looked for in /proc/PID/task/TID/stat, twice, a short while apart: it is one that could run both times, or whose CPU time grew.
// (Source: proc_pid_stat(5); sched(7) for who goes before whom.)
//
// Reads /proc for some milliseconds and sleeps in between: never from a real-time thread.
#pragma once

#include <sys/types.h>

#include <functional>
#include <optional>
#include <string>

#include "board/linux/pins_layout.h"

namespace qduino::board::linux {

struct CoreRival {
    pid_t pid = 0;
    pid_t tid = 0;
    std::string name;  ///< of the task, 15 bytes at most
    int policy = 0;    ///< SCHED_FIFO, SCHED_RR or SCHED_DEADLINE
    int priority = 0;  ///< 1…99; 0 with SCHED_DEADLINE
};

struct RivalSearch {
    int core = 0;
    int priority = 1;            ///< of the loop; whoever has less cannot keep it waiting
    pid_t not_of = 0;            ///< the sketch; the caller's own process is left out too
    std::string root;            ///< precedes /proc (tests)
    std::function<void()> wait;  ///< between the two looks; empty: sleeps 50 ms
};

/// The one that ran most; nothing when nobody did.
[[nodiscard]] std::optional<CoreRival> find_core_rival(const RivalSearch& search);

/// For the end of a sentence about loop `vcpu` of the sketch `sketch` on these pins: "core 1 was taken by stress-ng (pid 4711,
/// SCHED_FIFO 85)". Empty when the loop has not said where it runs, or nobody is found.
[[nodiscard]] std::string who_took_the_core_of(board::VcpuId vcpu, const PinsLayout& layout, pid_t sketch,
                                               const std::string& root = "");

}  // namespace qduino::board::linux
