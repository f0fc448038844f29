// Follows the steps of a motion behind a shaper.
//
// Input shaping and pressure advance (compensation.h) take X, Y and the filament off the asked path
// by a bounded amount, the reach, which is 0 at rest. One motor then no longer tells the place on
// the path: at a corner X is behind and Y ahead, and in a narrow zigzag a belt of CoreXY turns back
// long before the asked corner. So crossings are not followed. What holds is that the plan is
// always within the reach of where the slides stand:
//
//         cursor ●━━━━━━━╮ plan        The cursor stays while the slides are within its reach.
//                 ╲      ┃ ◎           When they are not, it goes on to the first place that is.
//            reach ╲ built             The plan is such a place. So the cursor is never ahead of
//                   ╲  ·               the plan, and follows it at most so far behind.
//
// On its way the cursor passes no place that is kPassBalls times as far: there the slides cannot
// have been. From the cursor on, as long as the slides come nearer: that place is compared and
// shown. The deviation of a shaped motion is its distance from the nearest piece around the cursor,
// and the tolerances grow by the reach. Whether the filament is really pushed ahead is looked at
// apart (advance_watch.h).
#pragma once

#include "twin/homing.h"
#include "twin/path_cursor.h"
#include "twin/probing.h"

namespace qduino::twin {

class ShapedFollower {
  public:
    /// All outlive this.
    ShapedFollower(PathCursor& cursor, Homing& homing, Probing& probing)
        : cursor_(cursor), homing_(homing), probing_(probing) {}

    /// A slide's motor made a step. True when the path explains it.
    [[nodiscard]] bool follow(const MotorStep& step);
    void follow_extruder(const MotorStep& step);
    /// A rest: filters have run out, and the slides stand on the path to a step.
    void rest();

  private:
    [[nodiscard]] PathPlace place() const { return {0, cursor_.so_far().share, {}, {}, false}; }
    [[nodiscard]] bool filament_leads(const AskedPiece& piece) const;
    [[nodiscard]] bool filament_is_past(const AskedPiece& piece) const;
    [[nodiscard]] bool first_within(PathPlace& place, double balls) const;
    [[nodiscard]] bool find_within(PathPlace& place, double balls);
    [[nodiscard]] bool begins_at_rest(const MotorStep& step);
    void show_place();

    PathCursor& cursor_;
    Homing& homing_;
    Probing& probing_;
};

}  // namespace qduino::twin
