// One axis of the twin: driver chip, motor, slide and switch, from three pins to a position.
//
//   STEP DIR ENABLE ─► A4988Chip ─► Motor: follows? ─► slide: room? ─► position ─► switch
//                          │               │                │                         │
//                    timing broken     too fast         the frame                endstop pin
//                          └────────── steps lost ──────────┘
//
// Invariant: position == start + microsteps moved up − microsteps moved down, always within the
// hard stops.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include "base/time.h"
#include "device/a4988_chip.h"
#include "twin/machine.h"
#include "twin/motor.h"

namespace qduino::twin {

/// Counts the microsteps of one axis since power-on by what became of them.
struct AxisCounters {
    std::uint64_t moved = 0;  ///< followed, either way
    std::uint64_t lost_pull_out = 0;
    std::uint64_t lost_hard_stop = 0;
    std::uint64_t lost_timing = 0;  ///< pulses that broke the driver's timing
    std::uint64_t ignored_disabled = 0;
    [[nodiscard]] std::uint64_t lost() const {
        return lost_pull_out + lost_hard_stop + lost_timing + ignored_disabled;
    }
};

class AxisDrive {
  public:
    AxisDrive(const AxisSpec& spec, bool is_slide)
        : motor_(spec.motor),
          up_when_high_(!spec.direction_inverted),
          position_(to_steps(spec, spec.start_mm)) {
        if (!is_slide) return;
        hard_minimum_ = to_steps(spec, spec.hard_minimum_mm);
        hard_maximum_ = to_steps(spec, spec.hard_maximum_mm);
        trigger_ = to_steps(spec, spec.trigger_mm);
        trigger_at_minimum_ = spec.trigger_at_minimum;
        has_switch_ = true;
        pressed_ = closes_at(position_);
    }

    /// The direction (+1, −1) of the microstep that this level completed, if the axis followed;
    /// else 0.
    int write_step(Instant now, bool level) {
        const std::optional<device::Microstep> step = chip_.write_step(now, level);
        if (!step) return 0;
        const int direction = step->direction_high == up_when_high_ ? 1 : -1;
        if (!connected_ || !motor_.follows(step->at, direction)) {
            ++counters_.lost_pull_out;
            return 0;
        }
        const std::int64_t wanted = position_ + direction;
        if (wanted < hard_minimum_ || wanted > hard_maximum_) {
            ++counters_.lost_hard_stop;
            return 0;
        }
        position_ = wanted;
        ++counters_.moved;
        return direction;
    }
    void write_direction(Instant now, bool level) { chip_.write_direction(now, level); }
    void write_enable(bool level) { chip_.write_enable(level); }

    /// After a step: true when the switch changed with it.
    [[nodiscard]] bool update_switch(Instant now) {
        if (!has_switch_ || closes_at(position_) == pressed_) return false;
        pressed_ = !pressed_;
        switched_at_ = now;
        return true;
    }

    [[nodiscard]] std::int64_t position() const { return position_; }
    [[nodiscard]] std::int64_t trigger() const { return trigger_; }
    [[nodiscard]] bool enabled() const { return chip_.enabled(); }
    [[nodiscard]] bool pressed() const { return pressed_; }
    [[nodiscard]] Instant switched_at() const { return switched_at_; }
    [[nodiscard]] const device::A4988Violations& violations() const { return chip_.violations(); }
    [[nodiscard]] AxisCounters counters() const {
        AxisCounters all = counters_;
        all.lost_timing = chip_.broken_pulses();
        all.ignored_disabled = chip_.ignored_while_disabled();
        return all;
    }
    /// A cut motor cable: the driver steps, nothing follows.
    void set_connected(bool connected) { connected_ = connected; }

    static std::int64_t to_steps(const AxisSpec& spec, double mm) {
        return static_cast<std::int64_t>(std::llround(mm * spec.steps_per_mm));
    }

  private:
    [[nodiscard]] bool closes_at(std::int64_t position) const {
        return trigger_at_minimum_ ? position <= trigger_ : position >= trigger_;
    }

    device::A4988Chip chip_;
    Motor motor_;
    bool up_when_high_;
    bool connected_ = true;
    bool has_switch_ = false;
    bool trigger_at_minimum_ = true;
    bool pressed_ = false;
    std::int64_t position_;
    std::int64_t hard_minimum_ = std::numeric_limits<std::int64_t>::min();
    std::int64_t hard_maximum_ = std::numeric_limits<std::int64_t>::max();
    std::int64_t trigger_ = 0;
    Instant switched_at_ = kEpoch - std::chrono::hours{1};
    AxisCounters counters_{};
};

}  // namespace qduino::twin
