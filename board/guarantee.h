// The guarantee report: for each loop and core, how much of what a sketch asked for a board can
// keep. A shortfall is said and never silent.
#pragma once

#include <cstdint>

#include "base/fixed_string.h"
#include "base/fixed_vector.h"
#include "base/time.h"
#include "board/types.h"

namespace qduino::board {

/// One line per loop.
struct LoopGuarantee : sched::Vcpu {
    /// Runs above everything but higher loops (SCHED_FIFO, or the simulator).
    bool priority_enforced = false;
    bool budget_enforced = false;  ///< cannot take more than its budget
    bool core_owned = false;       ///< no other task, movable interrupt or throttling on its core
    FixedString<200> shortfall{};  ///< why not, and the fix; empty when everything holds
};

/// One line per core in use.
struct CoreGuarantee {
    int core = 0;
    double interrupts_per_second = -1;  ///< residual; -1: not measured
    Nanoseconds worst_gap{-1};          ///< worst gap that a bare spin saw; -1: not measured
    double counted_per_second = -1;     ///< interrupts that admission counts; -1: none
    Nanoseconds counted_cost{};         ///< and how long each is
    bool tick_stopped = false;
    bool throttling_lifted = false;
    FixedString<200> note;
};

struct GuaranteeReport {
    FixedString<64> board;  ///< "linux, SCHED_FIFO" …
    bool simulated = false;
    bool memory_locked = false;
    FixedVector<LoopGuarantee, kVcpuLimit> loops;
    FixedVector<CoreGuarantee, 64> cores;
};

}  // namespace qduino::board
