// A G29 of the asked path, as the pins show it: from its first step on, the steps of all slides are
// skipped. Each time the probe has closed and the nozzle rests, its place is a point of the bed
// (bed_map.h). When all points are known and the nozzle rests where the file goes on, the
// comparison does, too. The path behind it follows the bed that was found.
#pragma once

#include "twin/excursions.h"
#include "twin/path_cursor.h"

namespace qduino::twin {

class Probing {
  public:
    /// All outlive this. `maps`: beds that were measured before.
    Probing(PathCursor& cursor, SeenMotors& motors, Excursions& excursions, int maps)
        : cursor_(cursor), motors_(motors), excursions_(excursions), map_(maps) {}

    [[nodiscard]] bool active() const { return active_; }
    /// `place` is at a G29: any slide that moves belongs to it. Then it begins.
    [[nodiscard]] bool begins(const PathPlace& place, const MotorStep& step);
    void on_touch() { touches_ = active_; }
    /// Before a step at `at` is counted: has the nozzle rested on a point, or at the end?
    void rest_until(Instant at);
    /// Has it rested at the end?
    void settle(Instant at);

  private:
    PathCursor& cursor_;
    SeenMotors& motors_;
    Excursions& excursions_;
    bool active_ = false;
    bool touches_ = false;  // the probe has closed, and the nozzle has not risen since
    int map_;               // of the bed that was measured last, or is
};

}  // namespace qduino::twin
