#include "printer/heat/heater_watch.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace qduino::printer::heat {

HeaterWatch::Fault HeaterWatch::words(const char* what, double value, const char* unit,
                                      const char* advice) const {
    char text[160];
    std::snprintf(text, sizeof text, "%s %s %.1f %s: heat is off; %s", name_, what, value, unit, advice);
    return Fault{text};
}

bool HeaterWatch::raise(const char* what, double value, const char* unit, const char* advice) {
    fault_ = words(what, value, unit, advice);
    return true;
}

void HeaterWatch::clear() {
    fault_.clear();
    persists_.clear();
    bad_readings_ = 0;
    target_ = Celsius{};
    reached_ = false;
    error_celsius_s_ = 0;
    have_last_ = false;
    highest_allowed_ = 0;
    running_away_ = false;
}

bool HeaterWatch::reads_badly(std::optional<Celsius> reading) {
    const bool good = reading && *reading >= config_.minimum && *reading <= config_.maximum;
    bad_readings_ = good ? 0 : std::min(bad_readings_ + 1, kBadReadings);
    persists_.clear();
    if (bad_readings_ < kBadReadings) return false;
    if (reading) {
        persists_ = words("sensor reads", reading->value(), "°C, outside its range",
                          "check the thermistor: open reads cold, shorted reads hot");
        return true;
    }
    persists_.assign(name_);
    persists_.append(
        " sensor does not answer: heat is off; check the thermistor's wires and the I2C converter");
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
    const double floor = target.value() - config_.verify_hysteresis_celsius;
    if (now_celsius.value() >= floor) {
        reached_ = true;
        error_celsius_s_ = 0;
        return false;
    }
    if (reached_) {
        const double dt = have_last_ ? to_seconds(now - last_) : 0.0;
        error_celsius_s_ += (floor - now_celsius.value()) * dt;
        if (error_celsius_s_ < config_.verify_error_celsius_s) return false;
        return raise("lost its temperature, now", now_celsius.value(), "°C",
                     "check heater cartridge, its wires and the fan's air stream");
    }
    if (now_celsius.value() >= goal_celsius_) {
        start_heating(now, now_celsius);
        return false;
    }
    if (now < goal_time_) return false;
    return raise("does not heat up, still", now_celsius.value(), "°C",
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
        running_away_ = false;
        return false;
    }
    if (!running_away_) {
        running_away_ = true;
        runaway_since_ = now;
    }
    if (to_seconds(now - runaway_since_) < kRunawaySeconds) return false;
    return raise("is far above what was asked,", now_celsius.value(), "°C",
                 "its switch may be stuck on: cut the power");
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
        target_ = target;
        reached_ = false;
        start_heating(now, *reading);
    }
    const bool raised = check_heating(now, *reading, target) || check_runaway(now, *reading, target);
    last_ = now;
    have_last_ = true;
    return raised;
}

}  // namespace qduino::printer::heat
