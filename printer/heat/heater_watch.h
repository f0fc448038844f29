// Watches one heater. Hardware can fail in ways that the control loop cannot see: a loose
// thermistor reads cold and asks for more power, and a switch can stick closed. So four rules
// compare what the sensor reads with what was asked. A broken rule is a fault, and a fault cuts the
// heat until a person clears it (`HeatControl`).
//
// 1. The sensor answers.
//    Four samples in a row without a reading, or with a reading below `minimum` or above
//    `maximum`, are a fault. One such sample may be noise on the wire.
//
// 2. The heater heats up.
//    Until it first reads target − `verify_hysteresis_celsius`, it must gain `verify_gain_celsius`
//    within `verify_gain_time`. Each gain starts the next such interval. Another target on the way
//    up does not: a job that changes its target every few seconds is watched as any other.
//
// 3. The heater holds its temperature.
//    From then on, its shortfall below target − `verify_hysteresis_celsius` is summed over time.
//    The sum must stay below `verify_error_celsius_s`. Readings above that line take from the sum
//    what they are above it, by the hysteresis at most, down to 0: a loose wire that reads right
//    now and then, or noise, does not wipe it out.
//
// 4. The heater does not run away.
//    Its reference is the highest target since it was last cool, or 40 °C if that is more. It must
//    not stay more than `kRunawayCelsius` above the reference for `kRunawaySeconds`. If its power
//    is off then, its switch is stuck on.
//
// Where the heater's model is known, a fifth rule compares power with temperature (heat_balance.h).
//
// The rules and figures follow Klipper's verify_heater and Marlin's thermal protection
// (docs/sources.md); the code is our own. Time is a parameter. Samples come at a regular interval:
// 8 ms on the reference machine.
#pragma once

#include <optional>

#include "base/quantity.h"
#include "base/text.h"
#include "base/time.h"
#include "printer/heat/heat_balance.h"
#include "printer/machine_config.h"

namespace qduino::printer::heat {

class HeaterWatch {
  public:
    using Fault = FixedString<160>;
    static constexpr int kBadReadings = 4;
    static constexpr double kRunawayCelsius = 25;
    static constexpr double kRunawaySeconds = 60;

    HeaterWatch(const HeaterConfig& config, const char* name) : config_(config), name_(name) {}

    /// One sample. `reading`: nullopt when the converter did not answer, or the thermistor reads
    /// open or short. `target`: 0 °C is off. True when this sample raises a fault; fault() keeps
    /// it.
    [[nodiscard]] bool sample(Instant now, std::optional<Celsius> reading, Celsius target);

    /// Rule 5 (heat_balance.h) of a heater that reads `reading`: anything but `fits` is a fault.
    void take_balance(HeatBalance::Verdict verdict, Celsius reading);

    [[nodiscard]] const HeaterConfig& config() const { return config_; }
    [[nodiscard]] bool faulted() const { return !fault_.empty(); }
    [[nodiscard]] const Fault& fault() const { return fault_; }
    /// The fault that would come back at once after clear(); empty: none. It is the sensor's: the
    /// watch reads the sensor while a fault is latched, too.
    [[nodiscard]] const Fault& persists() const { return persists_; }
    /// On the way up to its target: it has not reached the target since that was set.
    [[nodiscard]] bool heating_up() const { return !faulted() && target_.value() > 0 && !reached_; }
    /// Forgets everything, as if it had just been made.
    void clear() { *this = HeaterWatch{config_, name_}; }

  private:
    bool raise(std::string_view what, Celsius value, std::string_view advice);
    /// True after four bad readings in a row; `persists_` then says which.
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
    std::optional<Instant> last_;
    // The highest target since the heater was last cool: at first, and when it has cooled down by
    // kRunawayCelsius with its power off, the reading itself. Never decays.
    double highest_allowed_ = 0;
    std::optional<Instant> runaway_since_;
};

}  // namespace qduino::printer::heat
