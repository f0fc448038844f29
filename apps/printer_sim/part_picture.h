// The picture of a print for a person: the built part in the colours of its errors of height, the
// time of each kind of line, peak step rates, and the faults with their lines.
//
//   ┌ verdict ───────────────────────────────────┐
//   │  from a corner        │  from above, or    │
//   │                       │  one layer         │
//   │ ── thin ▒▒▒░░░░▒▒▒ thick ── ○ late  △ ooze │
//   │ time by feature │ heights, rates │ faults   │
//   └─────────────────────────────────────────────┘
#pragma once

#include <optional>
#include <string>

#include "apps/printer_sim/print_file.h"

namespace qduino::apps {

struct PartPictureOptions {
    std::string title;                 ///< the file's name
    std::optional<std::size_t> layer;  ///< from 1: seen alone from above; none: all
    double line_mm = 0.4;              ///< width of a line
};

/// A page of SVG. Error: not_found, when `result` has no cells (nothing was laid down), or no such
/// layer. Contract: result.observed.
[[nodiscard]] Result<std::string> part_picture(const PrintResult& result, const PartPictureOptions& options);

}  // namespace qduino::apps
