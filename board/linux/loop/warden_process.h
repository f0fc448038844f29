// The warden's own process: the whole of it.
//
//   waits for orders ─► looks at each ward when its BudgetWatch asks for it ─► holds, releases
//                       every 8 ms: threads in nobody's budget, if there are some (strangers.h)
//                       every 200 ms: rank and core of its wards, new threads, child processes
//
// It sleeps between two looks, and a look is bounded: some reads of /proc files that are open, and
// some system calls for each ward. It allocates nothing: it begins as a copy of a process whose
// other threads may have been anywhere. It ends with the sketch.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <cstdint>

#include "base/time.h"
#include "board/linux/kernel/cpu_list.h"
#include "board/linux/loop/warden_pages.h"

namespace qduino::board::linux {

struct WardenTask {
    pid_t sketch = 0;
    int priority = 0;  ///< SCHED_FIFO, above every ward; 0: an ordinary process
    CpuList cores;     ///< where it may run; empty: anywhere
    /// CPU time of one wait, which a ward has beside its budget in each period.
    Nanoseconds wait{};
    /// In shared memory, for the supervisor: by when it looks again (board/window/pins_layout.h).
    /// Null: there is none.
    std::atomic<std::int64_t>* by = nullptr;
    /// So long after a look it counts as dead.
    Nanoseconds patience{};
};

/// Runs in a child of the sketch, and does not return.
[[noreturn]] void be_warden(const WardenTask& task, WardenOrders& orders, WardenFindings& findings);

}  // namespace qduino::board::linux
