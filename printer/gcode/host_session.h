// The line protocol of a serial host: numbers and check sums, and the answer to a line that was
// lost or broken.
//
//   host:    N5 G1 X10*97   N6 … (lost)   N7 G1 X30*98
//   answer:  ok                           Error:Line Number is not Last Line Number+1, Last Line: 5
//                                             Resend: 6
//                                             ok
//
// The words are Marlin's, as hosts parse them. A line without a number passes unchecked, as in
// Marlin; but not one that has a check sum: its number was lost on the way.
#pragma once

#include <cstdint>

#include "base/fixed_string.h"
#include "printer/gcode/parser.h"

namespace qduino::printer::gcode {

struct HostVerdict {
    bool accepted = true;
    FixedString<160> reply;  ///< when refused: lines to send, each ended by LF but for the last
};

class HostSession {
  public:
    /// Judges a parsed line. Only an accepted line may be executed. M110 N sets the number of the
    /// last line.
    HostVerdict accept(const Line& line);
    /// Refuses what is known to be damaged without a look at it: `what` says why. The next line is
    /// asked for.
    [[nodiscard]] HostVerdict ask_again(const char* what) const;

  private:
    std::int64_t last_line_ = 0;
};

}  // namespace qduino::printer::gcode
