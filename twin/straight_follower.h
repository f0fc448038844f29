// Follows the steps of a motion without a shaper, by where the path crosses half steps.
//
// A perfect machine stands at the whole step nearest to the path, so it steps exactly where the
// path crosses a half step:
//
//   x  3 ┤                 ╭──built──     asked(s) ╱
//      2 ┤         ╭───────╯        ╱·  ← at this step of X the path is at x = 2½. That gives s;
//      1 ┤ ╭───────╯        ╱·         every other axis must stand within half a step of asked(s)
//      0 ┼─╯      ╱·
//        └──────────────────────────── s
//
// For every step of axis A to n, the cursor s moves forward to the first place where asked_A
// reaches the boundary n ∓ ½. It never moves back: a step whose boundary lies behind s is late, and
// moves nothing. Perfect stepping gives at most ½ step of deviation (plus the order in which
// near-simultaneous steps were sent).
//
// The extruder follows and does not lead: a step of E moves s only as far as no slide is
// contradicted. A slide that turns back behind its half-step may leave out the pair (turn.h): E
// goes on then. After an earlier job it is unknown where E's zero lies within a microstep, and one
// microstep of filament is 25 of the slides.
#pragma once

#include "twin/curve_follower.h"
#include "twin/homing.h"
#include "twin/path_cursor.h"
#include "twin/probing.h"

namespace qduino::twin {

class StraightFollower {
  public:
    /// E further behind than this waits for a step that was left out.
    static constexpr double kWaitingSteps = 3.0;
    /// After this many unexplained steps in a row the comparison gives up and only counts.
    static constexpr std::uint64_t kGiveUp = 20'000;

    /// All outlive this.
    StraightFollower(PathCursor& cursor, Homing& homing, Probing& probing)
        : cursor_(cursor), curve_(cursor), homing_(homing), probing_(probing) {}

    /// A slide's motor made a step. True when the path ahead explains it.
    [[nodiscard]] bool follow(const MotorStep& step);
    void follow_extruder(const MotorStep& step);

  private:
    [[nodiscard]] bool advance_in_piece(const MotorStep& step);
    [[nodiscard]] bool walk(const MotorStep& step);
    [[nodiscard]] double slides_reach(const PathPlace& place, bool behind);
    [[nodiscard]] bool turns_back(std::size_t axis, std::size_t index, double edge, double way);

    PathCursor& cursor_;
    CurveFollower curve_;
    Homing& homing_;
    Probing& probing_;
};

}  // namespace qduino::twin
