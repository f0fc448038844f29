// Input shaping and pressure advance as a job has set them, and the filters that follow.
//
// A shaper has a type, a frequency and a damping ratio, and a command may change one of them: the
// others are remembered, also while the shaper is off.
//
// Without pressure advance E is as planned. From the first advance above 0 on E is smoothed, also
// while the advance is 0 again: so each change but the first needs no standstill.
#pragma once

#include <array>
#include <optional>

#include "printer/gcode/actions.h"
#include "printer/motion/settings.h"

namespace qduino::printer::machine {

class Compensation {
  public:
    explicit Compensation(const MachineConfig& config)
        : shapers_{config.axes[Axis::x].shaper, config.axes[Axis::y].shaper},
          advance_(config.pressure_advance),
          asked_(motion::motion_settings(config).filters),
          appended_(asked_) {}

    void apply(const gcode::CompensationChange& change) {
        for (std::size_t axis = 0; axis < shapers_.size(); ++axis)
            apply(change.shapers[axis], shapers_[axis]);
        if (change.advance) advance_.advance = *change.advance;
        if (change.smooth_time) advance_.smooth_time = *change.smooth_time;
        asked_.shapers = shapers_;
        for (ShaperConfig& shaper : asked_.shapers)
            if (!shaper.active()) shaper = ShaperConfig{};
        const bool smooths = asked_.smooth_time > Seconds{0} || advance_.advance > Seconds{0};
        asked_.smooth_time = smooths ? advance_.smooth_time : Seconds{0};
    }
    /// To be as `settings` are; what was appended was.
    void take(const Compensation& settings) {
        shapers_ = settings.shapers_;
        advance_ = settings.advance_;
        asked_ = settings.asked_;
    }
    [[nodiscard]] Seconds advance() const { return advance_.advance; }

    /// The filters that were asked for, if they are not those that were appended last; they are
    /// then.
    [[nodiscard]] std::optional<motion::MotionFilters> take_change() {
        if (asked_ == appended_) return std::nullopt;
        appended_ = asked_;
        return asked_;
    }
    /// What was appended since is gone: `filters` are in force.
    void in_force(const motion::MotionFilters& filters) { appended_ = filters; }

  private:
    static void apply(const gcode::CompensationChange::Shaper& change, ShaperConfig& shaper) {
        if (change.frequency_hz) shaper.frequency_hz = *change.frequency_hz;
        if (change.damping_ratio) shaper.damping_ratio = *change.damping_ratio;
        if (change.type) {
            shaper.type = *change.type;
        } else if (change.frequency_hz && shaper.type == ShaperType::none) {
            shaper.type = change.type_at_first;
        }
    }

    std::array<ShaperConfig, 2> shapers_;
    AdvanceConfig advance_;
    motion::MotionFilters asked_;
    motion::MotionFilters appended_;
};

}  // namespace qduino::printer::machine
