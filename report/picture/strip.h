// A schedule for a terminal of 80 columns: a line for each VCPU, and R against T.
//
//   core 0
//     loop 3   █ █ █ █ █ █      loop 3   ████▒▒▒▒▒▒▒▒········│  R 4 ms of 10 ms
//     loop 1   ·████░░░█
//   pins
//     pin 13   ▔▔▔▔▁▁▁▁▔▔▔▔▁▁▁▁
#pragma once

#include <string>

#include "report/picture/schedule.h"

namespace qduino::apps::picture {

/// Which signs the terminal has.
enum class Signs : std::uint8_t {
    ascii,
    blocks,  ///< of Unicode
};

/// As the locale of the environment says ($LC_ALL, else $LC_CTYPE, else $LANG: POSIX.1, 8.2).
[[nodiscard]] Signs signs_of_terminal();

/// Schedules with more rows have no strip: it would fill the screen, and a page of SVG shows them.
inline constexpr std::size_t kStripRows = 12;

/// Lines of at most 80 columns, each with its end. The loops of a schedule of more than kStripRows
/// rows are left out; of as many pins the rest is counted. Empty: there is nothing to show.
/// `colours`: those of a terminal (terminal/colour.h).
[[nodiscard]] std::string strip(const Schedule& schedule, Signs signs, bool colours = false);

}  // namespace qduino::apps::picture
