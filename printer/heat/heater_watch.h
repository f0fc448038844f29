// Watches one heater: four ways to be wrong, each of which latches and cuts the heat until a person clears
// it.
//
//   reading     missing, or outside [minimum, maximum]: four in a row (one may be noise on the wire)
//   not heating below target − hysteresis: must gain `verify_gain_celsius` in every `verify_gain_s`
//   drifting    after the target was reached: ∫(target − hysteresis − T) dt may not pass
//   `verify_error_celsius_s` runaway     more than `kRunawayCelsius` above everything that was asked, for
//   `kRunawaySeconds`, heater off: the switch is stuck on
//
// The rules and figures follow the safety section of the project's sources (Klipper's verify_heater, Marlin's
// thermal protection); the code is our own. Time is a parameter; sampling is regular (8 ms on the reference
// machine).
#pragma once

#include <optional>

#include "base/fixed_string.h"
#include "base/quantity.h"
#include "base/time.h"
#include "printer/machine_config.h"

namespace qduino::printer::heat {

class HeaterWatch {
  public:
    using Fault = FixedString<160>;
    static constexpr int kBadReadings = 4;
    static constexpr double kRunawayCelsius = 25;
    static constexpr double kRunawaySeconds = 60;

    HeaterWatch(const HeaterConfig& config, const char* name) : config_(config), name_(name) {}

    /// One sample: the reading (nullopt: the converter did not answer, or the thermistor reads open or
    /// short), the target (0 °C: off). Returns the fault when this sample raises it; fault() keeps it.
    [[nodiscard]] bool sample(Instant now, std::optional<Celsius> reading, Celsius target);

    [[nodiscard]] bool faulted() const { return !fault_.empty(); }
    [[nodiscard]] const Fault& fault() const { return fault_; }
    /// What would fault again at once if it were cleared now: the sensor, which is looked at while a fault is latched, too.
    /// Empty: nothing.
    [[nodiscard]] const Fault& persists() const { return persists_; }
    /// On the way up to its target, which it has not reached since that was set.
    [[nodiscard]] bool heating_up() const { return !faulted() && target_.value() > 0 && !reached_; }
    void clear();

  private:
    [[nodiscard]] Fault words(const char* what, double value, const char* unit, const char* advice) const;
    bool raise(const char* what, double value, const char* unit, const char* advice);
    /// Four bad readings in a row; `persists_` then says which.
    bool reads_badly(std::optional<Celsius> reading);
    bool check_heating(Instant now, Celsius now_celsius, Celsius target);
    bool check_runaway(Instant now, Celsius now_celsius, Celsius target);
    void start_heating(Instant now, Celsius from);

    HeaterConfig config_;
    const char* name_;
    Fault fault_;
    Fault persists_;
    int bad_readings_ = 0;
    Celsius target_{};
    bool reached_ = false;
    Instant goal_time_{};         // by then …
    double goal_celsius_ = 0;     // … it must be this warm
    double error_celsius_s_ = 0;  // the accumulated error since it was reached
    Instant last_{};
    bool have_last_ = false;
    double highest_allowed_ = 0;  // decays never: the highest target since the heater was last cool
    Instant runaway_since_{};
    bool running_away_ = false;
};

}  // namespace qduino::printer::heat
