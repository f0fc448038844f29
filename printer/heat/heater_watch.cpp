#include "printer/heat/heater_watch.h"

#include <algorithm>

namespace qduino::printer::heat {

bool HeaterWatch::raise(std::string_view what, Celsius value, std::string_view advice) {
    fault_ = text<Fault>(name_, ' ', what, ' ', Fixed{value.value(), 1}, " °C: heat is off; ", advice);
    return true;
}

bool HeaterWatch::reads_badly(std::optional<Celsius> reading) {
    const bool good = reading && *reading >= config_.minimum && *reading <= config_.maximum;
    bad_readings_ = good ? 0 : std::min(bad_readings_ + 1, kBadReadings);
    persists_.clear();
    if (bad_readings_ < kBadReadings) return false;
    persists_ = reading ? text<Fault>(name_, " sensor reads ", Fixed{reading->value(), 1},
                                      " °C, outside its range: heat is off; check the thermistor: open reads "
                                      "cold, shorted reads hot")
                        : text<Fault>(name_,
                                      " sensor does not answer: heat is off; check the thermistor's wires "
                                      "and the I2C converter");
    return true;
}

void HeaterWatch::start_heating(Instant now, Celsius from) {
    goal_celsius_ = from.value() + config_.verify_gain_celsius;
    goal_time_ = now + from_seconds(config_.verify_gain_time.value());
    error_celsius_s_ = 0;
}

bool HeaterWatch::check_heating(Instant now, Celsius now_celsius, Celsius target) {
    if (target.value() <= 0) {
        reached_ = false;
        return false;
    }
    const double hysteresis = config_.verify_hysteresis_celsius;
    const double shortfall = target.value() - hysteresis - now_celsius.value();
    if (shortfall <= 0 && !reached_) {
        reached_ = true;
        error_celsius_s_ = 0;
        return false;
    }
    if (reached_) {
        const double dt = last_ ? to_seconds(now - *last_) : 0.0;
        error_celsius_s_ = std::max(error_celsius_s_ + std::max(shortfall, -hysteresis) * dt, 0.0);
        if (error_celsius_s_ < config_.verify_error_celsius_s) return false;
        return raise("lost its temperature, now", now_celsius,
                     "check heater cartridge, its wires and the fan's air stream");
    }
    if (now_celsius.value() >= goal_celsius_) {
        start_heating(now, now_celsius);
        return false;
    }
    if (now < goal_time_) return false;
    return raise("does not heat up, still", now_celsius,
                 "check heater cartridge, thermistor seat and their wires");
}

bool HeaterWatch::check_runaway(Instant now, Celsius now_celsius, Celsius target) {
    highest_allowed_ = std::max(highest_allowed_, target.value());
    if (target.value() <= 0 && now_celsius.value() < highest_allowed_ - kRunawayCelsius) {
        // It has cooled down: if it warms up again, nothing asked for that.
        highest_allowed_ = std::max(now_celsius.value(), 0.0);
    }
    if (highest_allowed_ <= 0) highest_allowed_ = now_celsius.value();
    const double limit = std::max(highest_allowed_, 40.0) + kRunawayCelsius;
    if (now_celsius.value() <= limit) {
        runaway_since_.reset();
        return false;
    }
    if (!runaway_since_) runaway_since_ = now;
    if (to_seconds(now - *runaway_since_) < kRunawaySeconds) return false;
    return raise("is far above what was asked,", now_celsius, "its switch may be stuck on: cut the power");
}

void HeaterWatch::take_balance(HeatBalance::Verdict verdict, Celsius reading) {
    if (faulted() || verdict == HeatBalance::Verdict::fits) return;
    if (verdict == HeatBalance::Verdict::frozen) {
        raise("reads the same while its power changes,", reading, "check the sensor and its wires");
    } else if (verdict == HeatBalance::Verdict::too_hot) {
        raise("is warmer than its power explains,", reading, "its switch may be stuck on: cut the power");
    } else {
        raise("is colder than its power explains,", reading,
              "check sensor seat, heater and wires; new parts: M306 T");
    }
}

bool HeaterWatch::sample(Instant now, std::optional<Celsius> reading, Celsius target) {
    const bool bad = reads_badly(reading);
    if (faulted()) return false;
    if (bad) {
        fault_ = persists_;
        return true;
    }
    if (!reading) return false;
    if (target != target_) {
        const bool goes_on = heating_up() && target.value() > 0;
        target_ = target;
        reached_ = false;
        if (!goes_on) start_heating(now, *reading);
    }
    const bool raised = check_heating(now, *reading, target) || check_runaway(now, *reading, target);
    last_ = now;
    return raised;
}

}  // namespace qduino::printer::heat
