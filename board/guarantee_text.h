// The guarantee report in words for a terminal of 80 columns, and as JSON for programs.
//
//   guarantee: linux, SCHED_FIFO; memory locked
//     loop  core  budget / period         priority  budget    core
//        1     0  30 ms / 100 ms          enforced  enforced  shared
//        2     1  100 us / 100 us         enforced  never     OWNED
//     core 1: 252 interrupts/s left, worst gap of a bare spin 14.2 us, tick on
#pragma once

#include <string>

#include "board/guarantee.h"

namespace qduino::board {

/// Lines of at most 80 columns, each ended by '\n'. Setup-time: allocates.
[[nodiscard]] std::string guarantee_text(const GuaranteeReport& report);

/// One JSON object on one line: board, simulated, memory_locked; loops, each with id, core, budget_us,
/// period_us, priority_enforced, budget_enforced, core_owned, shortfall; cores, each with core,
/// interrupts_per_second and worst_gap_us (null: not measured), tick_stopped, throttling_lifted, note.
/// Setup-time: allocates.
[[nodiscard]] std::string guarantee_json(const GuaranteeReport& report);

}  // namespace qduino::board
