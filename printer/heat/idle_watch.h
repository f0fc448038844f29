// Switches off heaters that nobody uses. A job may consist of M109 S200 alone, a pause may never be
// ended, a service may never return: without this watch the heat would stay on.
//
//   use    ──●●●●●●●●────────────────────────────────    step pulses, a temperature asked for, …
//   left            ┌ 600 s ──────────────────────┐
//                   quiet: -1  590, 589 …         0: off, latched until a temperature is asked for
//
// Use is one of these:
// - Step pulses went out. A dwell is no use: nothing moves.
// - A temperature was asked for, maybe the same again.
// - A heater is on its way up to its target for the first time (HeaterWatch bounds that), or down
//   to it. Each kCoolingStep nearer counts, so that a wait for a heater that never cools ends, too.
//
// Pure. Loop 3 alone calls it. It needs neither loop 1 nor loop 2: when they are silent, that is no
// use.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "base/time.h"

namespace qduino::printer::heat {

/// One sample of the heaters and of their use.
struct HeatUse {
    struct Heater {
        double celsius = 0;
        double target_celsius = 0;  ///< 0: off
        bool heating_up = false;    ///< HeaterWatch::heating_up()
    };
    std::array<Heater, 2> heaters{};
    std::uint64_t pulses = 0;    ///< step pulses ever sent
    std::uint32_t requests = 0;  ///< temperatures ever asked for
};

class IdleWatch {
  public:
    static constexpr double kCoolingStep = 1.0;  // °C
    /// For this long after the last use, no countdown is shown.
    static constexpr Nanoseconds kQuiet = 10s;

    /// `timeout_s`: 0 never times out.
    explicit IdleWatch(double timeout_s) : timeout_(from_seconds(timeout_s)) {}

    /// One sample. True: heat must be off, now and until a temperature is asked for. Calls come in
    /// order of time.
    [[nodiscard]] bool sample(Instant now, const HeatUse& use);

    [[nodiscard]] bool timed_out() const { return timed_out_; }
    /// The time until the heaters go off, as of the last sample. Nothing while they are off or in
    /// use.
    [[nodiscard]] std::optional<Nanoseconds> left() const { return left_; }

  private:
    [[nodiscard]] bool is_used(const HeatUse& use);
    [[nodiscard]] bool comes_nearer(std::size_t which, const HeatUse::Heater& heater);

    Nanoseconds timeout_;
    bool started_ = false;
    bool timed_out_ = false;
    Instant used_{};
    std::optional<Nanoseconds> left_;
    std::uint64_t pulses_ = 0;
    std::uint32_t requests_ = 0;
    std::array<double, 2> targets_{};
    // The lowest reading of each cooling heater that has counted as use.
    std::array<double, 2> nearest_{};
};

}  // namespace qduino::printer::heat
