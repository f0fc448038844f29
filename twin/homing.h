// A G28 of the asked path, as the pins show it: the steps of the motors that move its slides are
// skipped until homing_watch.h finds these home. The place where a slide then stands gets the
// coordinate of the switch (home_mm). A motor stands on a whole step, so its coordinate is rounded
// to one.
//
// Just before a G28 an excursion is told from the homing by its first step: that leads a slide from
// its open switch. Where the switches are closed, between two G28 without a move, it begins as the
// homing does. It gives itself away when a slide moves that has been homed already, or is not to
// be: no homing goes on before all of its slides are home. Then the head is away since the rest
// before, and the G28 is still to come. (An excursion that opens every switch and comes back looks
// like a homing from its begin to its end; then the homing itself is the excursion. The places
// agree either way.)
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "twin/excursions.h"
#include "twin/homing_watch.h"
#include "twin/path_cursor.h"

namespace qduino::twin {

class Homing {
  public:
    /// All outlive this.
    Homing(PathCursor& cursor, SeenMotors& motors, Excursions& excursions)
        : cursor_(cursor), motors_(motors), excursions_(excursions) {}

    /// `place` is at a G28: does the step belong to it? Then it begins.
    [[nodiscard]] bool begins(const PathPlace& place, const MotorStep& step);
    /// Call before a step at `at` that moves the slides `moved`, a mask (0: no step, only time has
    /// passed).
    void settle(Instant at, std::uint8_t moved) {
        if (active()) end(watch_.settle(at, moved));
    }
    void on_endstop(Instant at, int axis, bool pressed) {
        if (active()) watch_.on_endstop(at, axis, pressed);
    }
    /// True when a step that moves the slides `moved` shows that what began as a homing is an
    /// excursion. The homing has not begun then.
    [[nodiscard]] bool was_excursion(std::uint8_t moved);

    [[nodiscard]] bool active() const { return watch_.active(); }
    /// Slides that look for their switches now, as a mask.
    [[nodiscard]] std::uint8_t pending() const { return watch_.pending(); }
    /// Steps of each slide at which it came to rest on its switch.
    [[nodiscard]] const std::array<std::int64_t, kSlideCount>& homed_at() const { return homed_at_; }

  private:
    [[nodiscard]] bool leads_from_open_switch(const MotorStep& step) const;
    void end(std::uint8_t homed);

    PathCursor& cursor_;
    SeenMotors& motors_;
    Excursions& excursions_;
    HomingWatch watch_;
    std::array<std::int64_t, kSlideCount> homed_at_{};
    /// The origin at the rest that a homing began at, which may be an excursion.
    std::optional<std::array<double, kAxisCount>> origin_at_rest_;
};

}  // namespace qduino::twin
