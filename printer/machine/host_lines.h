// The lines of a serial host, counted as they become over: so many more the service may send, and
// so it knows when to say `ok`.
//
//   service   sent ────────────────┐  window: sent − over ≤ link::kHostLinesMax
//   console   waiting │ in hand │ over
//                       └─ a move is over when the planner has it; M109 when the heat is there,
//                          M400 when everything has been played (gcode::Ok)
//
// One line is in hand at most, and no other line is carried out meanwhile. Loop 1 only.
#pragma once

#include <cstdint>
#include <optional>

#include "printer/gcode/command_table.h"

namespace qduino::printer::machine {

class HostLines {
  public:
    /// A line is carried out now. Contract: none is in hand.
    void begin(gcode::Ok ok) {
        QDUINO_EXPECT(!in_hand_);
        in_hand_ = ok;
    }
    [[nodiscard]] bool in_hand() const { return in_hand_.has_value(); }
    /// The line in hand (M0) waits for let_go() as well.
    void hold() { held_ = in_hand(); }
    void let_go() { held_ = false; }

    /// `done`: nothing is left of the line, no wait, no homing. `still`: all motion before has been
    /// played, too.
    void settle(bool done, bool still) {
        if (!in_hand_ || held_) return;
        if (*in_hand_ != gcode::Ok::at_once && !done) return;
        if (*in_hand_ == gcode::Ok::when_still && !still) return;
        drop(0);
    }
    /// The line in hand and `waiting` others will not be done.
    void drop(std::size_t waiting) {
        over_ += waiting + (in_hand_ ? 1 : 0);
        in_hand_.reset();
        held_ = false;
    }
    /// A line that came is over, and was never in hand.
    void refuse() { ++over_; }
    /// Since the start.
    [[nodiscard]] std::uint64_t over() const { return over_; }

  private:
    std::optional<gcode::Ok> in_hand_;
    bool held_ = false;
    std::uint64_t over_ = 0;
};

}  // namespace qduino::printer::machine
