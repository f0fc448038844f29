// Switches heaters off that nobody uses: a job that was only M109 S200, a pause that nobody ends, a service that never returns.
//
//   use    ──●●●●●●●●──────────────────────────────────────────      step pulses, a temperature asked for, on its way there
//   left            ┌ 600 s ─────────────────────────┐
//                   quiet: -1  590, 589 …            0: off, latched until a temperature is asked for again
//
// What counts as use:
//   - step pulses went out (a dwell is none: nothing moves),
//   - somebody asked for a temperature, also for the same again,
//   - a heater is on its way up to its target for the first time (HeaterWatch bounds that), or down to it: each kCoolingStep
//     nearer counts, so that a wait for something that never cools comes to its end too.
//
// Pure; loop 3 alone; needs neither loop 1 nor loop 2 to be alive: their silence is no use.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "base/time.h"

namespace qduino::printer::heat {

/// What one sample shows of the heaters and of who uses them.
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
    /// Used so lately, nothing is counted down for people to see.
    static constexpr Nanoseconds kQuiet = 10s;

    /// `timeout_s`: 0 never times out.
    explicit IdleWatch(double timeout_s) : timeout_(from_seconds(timeout_s)) {}

    /// One sample. True: heat must be off, now and until a temperature is asked for. Calls come in order of time.
    [[nodiscard]] bool sample(Instant now, const HeatUse& use);

    [[nodiscard]] bool timed_out() const { return timed_out_; }
    /// As of the last sample, until the heaters go off; nothing while they are off, or in use.
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
    std::array<double, 2> nearest_{};  // of each heater that cools down: the lowest reading that has counted
};

}  // namespace qduino::printer::heat
