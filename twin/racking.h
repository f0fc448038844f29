// Motors that move one slide together: do they?
//
//   first motor   ||||||||||||||||||
//   second        |||||||||| ||||||     one step short: that end of the slide now hangs back
//
// The distance between the two is that at the job's start, or since the slide was homed. A motor
// with a switch of its own is at its switch then; `off_switch` says how far from it. While the
// slide homes, each motor goes to its own switch, and nothing is compared.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "twin/machine.h"

namespace qduino::twin {

class Racking {
  public:
    /// `apart`: how far the extra motor is from the first one, in steps.
    Racking(const ExtraMotorSpec& spec, std::int64_t apart)
        : slide_(spec.slide), has_switch_(spec.endstop_pin != kNotWired), level_(apart) {}

    [[nodiscard]] std::uint8_t slide() const { return slide_; }
    /// After a step of either motor. `homing`: the slide looks for its switches.
    void on_step(std::int64_t apart, bool homing) {
        if (homing) {
            was_homing_ = true;
            return;
        }
        if (was_homing_) settle(apart);
        worst_ = std::max(worst_, std::abs(apart - level_));
    }
    /// Nothing moves any more.
    void finish(std::int64_t apart) { on_step(apart, false); }

    /// The most that the two were apart. One step is the order in which their pulses come.
    [[nodiscard]] std::int64_t worst() const { return worst_; }
    [[nodiscard]] std::int64_t off_switch() const { return off_switch_; }

  private:
    // The first motor is at the slide's switch, and both switches are level.
    void settle(std::int64_t apart) {
        was_homing_ = false;
        if (has_switch_) off_switch_ = std::max(off_switch_, std::abs(apart));
        level_ = apart;
    }

    std::uint8_t slide_;
    bool has_switch_;
    bool was_homing_ = false;
    std::int64_t level_;
    std::int64_t worst_ = 0;
    std::int64_t off_switch_ = 0;
};

}  // namespace qduino::twin
