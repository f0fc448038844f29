// What a person wants to see of one print beyond the verdict: heights, time by line, peak rates. A
// job fills it in when it is given one, and is some 40 % slower for it (docs/twin.md).
#pragma once

#include <array>
#include <cstddef>

#include "twin/gantry.h"
#include "twin/height_map.h"
#include "twin/inspector.h"
#include "twin/line_clock.h"
#include "twin/observer.h"
#include "twin/step_rates.h"

namespace qduino::twin {

class PrintRecord {
  public:
    /// `keep_cells`: for a picture.
    PrintRecord(const Machine& machine, Instant now, bool keep_cells)
        : gantry_(machine), heights_(machine, keep_cells), clock_(now) {
        for (std::size_t axis = 0; axis < kAxisCount; ++axis)
            mm_per_step_[axis] = 1 / machine.axes[axis].steps_per_mm;
    }

    /// After the inspector has seen it.
    void on_step(const StepSeen& step, const Inspector& inspector) {
        rates_.step(step.at, step.axis);
        clock_.step(step.at, inspector.line());
        if (!inspector.on_path()) return heights_.leave_path(step.at);
        if (step.axis == kExtruder) return heights_.extruder_step(step.at, step.direction);
        // A slow Z lays nothing; of a delta's carriages none is slow.
        if (step.axis > 1 && gantry_.is_linear()) return;
        Position motors_mm{};
        for (std::size_t motor = 0; motor < kAxisCount; ++motor)
            motors_mm[motor] = inspector.asked_steps()[motor] * mm_per_step_[motor];
        Position nozzle_mm = gantry_.nozzle_at(motors_mm);
        nozzle_mm[2] -= inspector.lift_by_bed(nozzle_mm);
        heights_.slide_step(step.at, nozzle_mm, inspector.line(), !inspector.on_curve());
    }
    void set_hot(Instant now, bool hot) { heights_.set_hot(now, hot); }

    /// Call once, after the last step.
    [[nodiscard]] Heights finish(Instant now) { return heights_.finish(now); }
    [[nodiscard]] const LineClock& clock() const { return clock_; }
    [[nodiscard]] const StepRates& rates() const { return rates_; }

  private:
    Gantry gantry_;
    std::array<double, kAxisCount> mm_per_step_{};
    HeightMap heights_;
    LineClock clock_;
    StepRates rates_;
};

}  // namespace qduino::twin
