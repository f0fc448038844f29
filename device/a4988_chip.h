// A4988: the chip's side. Turns edges on STEP, DIR and ENABLE into microsteps, and counts every
// broken timing rule.
//
// A real chip may or may not step on a pulse that is too short. This model takes the worse view: a
// pulse that breaks a rule is lost. Two of the rules (the pulse's width, and DIR's hold time) are
// decided only when STEP falls. So the microstep is handed out then, with the instant of the rising
// edge, as in the chip.
//
//   STEP ___┌────────┐___     rises: the set-up of DIR and the low time before are judged
//           ^        ^        falls: the width and DIR's hold are judged: a step, or a violation
//
// Invariants: instants never go back; at most one microstep for each rising edge.
#pragma once

#include <cstdint>
#include <optional>

#include "base/time.h"
#include "device/a4988.h"

namespace qduino::device {

/// Broken timing rules, counted.
struct A4988Violations {
    std::uint64_t step_high_short = 0;
    std::uint64_t step_low_short = 0;
    std::uint64_t direction_setup_short = 0;
    std::uint64_t direction_hold_short = 0;
    [[nodiscard]] constexpr std::uint64_t total() const {
        return step_high_short + step_low_short + direction_setup_short + direction_hold_short;
    }
};

/// A microstep that the chip made.
struct Microstep {
    Instant at{};                 ///< the rising edge
    bool direction_high = false;  ///< level of DIR at the rising edge
};

class A4988Chip {
  public:
    /// STEP has `level` from `now` on. Returns a microstep when this ends a pulse that kept every
    /// rule.
    std::optional<Microstep> write_step(Instant now, bool level) {
        if (level == step_) return std::nullopt;
        step_ = level;
        if (!level) return fall(now);
        rise(now);
        return std::nullopt;
    }
    void write_direction(Instant now, bool level) {
        if (level == direction_) return;
        direction_ = level;
        if (step_ && now - rose_at_ < a4988::kDirectionHoldMin) spoil(violations_.direction_hold_short);
        direction_changed_at_ = now;
    }
    /// ENABLE is active low, and low when nothing drives it.
    void write_enable(bool level) { enabled_ = !level; }

    [[nodiscard]] bool enabled() const { return enabled_; }
    [[nodiscard]] const A4988Violations& violations() const { return violations_; }
    /// Pulses that broke at least one rule, and made no microstep.
    [[nodiscard]] std::uint64_t broken_pulses() const { return broken_pulses_; }
    /// Pulses that reached the chip while it was disabled: ignored, as the chip does.
    [[nodiscard]] std::uint64_t ignored_while_disabled() const { return ignored_; }

  private:
    void rise(Instant now) {
        broken_ = false;
        if (now - fell_at_ < a4988::kStepLowMin) spoil(violations_.step_low_short);
        if (now - direction_changed_at_ < a4988::kDirectionSetupMin) spoil(violations_.direction_setup_short);
        rose_at_ = now;
        direction_at_rise_ = direction_;
    }
    std::optional<Microstep> fall(Instant now) {
        fell_at_ = now;
        if (now - rose_at_ < a4988::kStepHighMin) spoil(violations_.step_high_short);
        if (!enabled_) {
            ++ignored_;
            return std::nullopt;
        }
        if (broken_) {
            ++broken_pulses_;
            return std::nullopt;
        }
        return Microstep{rose_at_, direction_at_rise_};
    }

    void spoil(std::uint64_t& violation) {
        broken_ = true;
        ++violation;
    }

    // Long before anything: the first edge of a program breaks no rule.
    static constexpr Instant kLongAgo = kEpoch - std::chrono::hours{1};
    Instant rose_at_ = kLongAgo;
    Instant fell_at_ = kLongAgo;
    Instant direction_changed_at_ = kLongAgo;
    bool step_ = false;
    bool direction_ = false;
    bool direction_at_rise_ = false;
    bool enabled_ = true;
    bool broken_ = false;
    A4988Violations violations_{};
    std::uint64_t broken_pulses_ = 0;
    std::uint64_t ignored_ = 0;
};

}  // namespace qduino::device
