// An admission in words, for a terminal of 80 columns: why a loop was refused, and what would help.
//
//   loop 4 (10.001 ms in 100 ms) is refused on core 0:
//     R = 186.001 ms > T = 100 ms
//     who takes its 100 ms, at worst:
//       loop 4 itself                      10.001 ms
//       loop 3                                 40 ms
//       loop 1                                 30 ms
//       loop 2                                 20 ms
//       together                          100.001 ms
//     smallest change that would be admitted, each alone:
//       budget 10 ms (1 us less)
//       period 186.001 ms (86.001 ms more)
#pragma once

#include "base/fixed_string.h"
#include "sched/placement.h"
#include "sched/verdict.h"

namespace qduino::sched {

/// Lines end in '\n' and are at most 80 columns long. There is room for the fullest core. When many
/// cores are full, the end of the text is cut.
using Explanation = FixedString<8192>;

/// The table of a core: how it was admitted, each loop's R and T; or the refusal.
[[nodiscard]] Explanation explain(const Admission& admission);
/// The refusal alone. Empty when there is none.
[[nodiscard]] Explanation explain(const Refusal& refusal, int core);
/// A line of a table of shares: `taker`, and what it takes behind it.
void write_amount(Explanation& out, std::string_view taker, Nanoseconds amount);
/// Every core in use, then the refusal, if any.
[[nodiscard]] Explanation explain(const MulticoreAdmission& computer);

}  // namespace qduino::sched
