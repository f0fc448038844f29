// One motor of the twin with its driver chip: from three pins to a position.
//
//   STEP DIR ENABLE ─► A4988Chip ─► Motor: follows? ─► slides: room? ─► position
//                          │               │                │
//                    timing broken     too fast         the frame
//                          └────────── steps lost ──────────┘
//
// Invariant: position == start + microsteps moved up − microsteps moved down.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>

#include "base/time.h"
#include "device/a4988_chip.h"
#include "twin/machine.h"
#include "twin/motor.h"

namespace qduino::twin {

/// Counts the microsteps of one motor since power-on by what became of them.
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
    AxisDrive(const MotorSpec& motor, bool direction_inverted, std::int64_t position)
        : motor_(motor), up_when_high_(!direction_inverted), position_(position) {}

    /// The direction (+1, −1) of the microstep that this level completed, if the motor made it;
    /// else 0. `has_room(position)`: nothing stands in the way there.
    template <typename HasRoom>
    int write_step(Instant now, bool level, HasRoom&& has_room) {
        const std::optional<device::Microstep> step = chip_.write_step(now, level);
        if (!step) return 0;
        const int direction = step->direction_high == up_when_high_ ? 1 : -1;
        if (!connected_ || !motor_.follows(step->at, direction)) {
            ++counters_.lost_pull_out;
            return 0;
        }
        if (!has_room(position_ + direction)) {
            ++counters_.lost_hard_stop;
            return 0;
        }
        position_ += direction;
        ++counters_.moved;
        return direction;
    }
    void write_direction(Instant now, bool level) { chip_.write_direction(now, level); }
    void write_enable(bool level) { chip_.write_enable(level); }

    [[nodiscard]] std::int64_t position() const { return position_; }
    [[nodiscard]] bool enabled() const { return chip_.enabled(); }
    [[nodiscard]] const device::A4988Violations& violations() const { return chip_.violations(); }
    [[nodiscard]] AxisCounters counters() const {
        AxisCounters all = counters_;
        all.lost_timing = chip_.broken_pulses();
        all.ignored_disabled = chip_.ignored_while_disabled();
        return all;
    }
    /// A cut motor cable: the driver steps, nothing follows.
    void set_connected(bool connected) { connected_ = connected; }

  private:
    device::A4988Chip chip_;
    Motor motor_;
    bool up_when_high_;
    bool connected_ = true;
    std::int64_t position_;
    AxisCounters counters_{};
};

}  // namespace qduino::twin
