#include "printer/estimate/heat_forecast.h"

#include <algorithm>

#include "device/ads7828.h"

namespace qduino::printer::estimate {

std::optional<Celsius> HeatForecast::Block::shown() const {
    const double fraction = sensor.fraction(Celsius{state.sensor_celsius});
    const int number = static_cast<int>(std::clamp(fraction, 0.0, 1.0) * device::ads7828::kFullScale);
    const Result<Celsius> read =
        sensor.celsius(device::ads7828::fraction(std::min(number, device::ads7828::kFullScale - 1)));
    return read.ok() ? std::optional{*read} : std::nullopt;
}

void HeatForecast::Block::settle(double duration_s, double room_celsius) {
    if (target_celsius > 0) {
        state = {target_celsius, target_celsius};
        return;
    }
    advance(0, room_celsius, duration_s);
}

HeatForecast::HeatForecast(const MachineConfig& machine)
    : room_celsius_(machine.room.value()),
      has_bed_(machine.has_bed),
      control_(machine, unread_),
      blocks_{Block{machine.hot_end, room_celsius_}, Block{machine.bed, room_celsius_}} {}

void HeatForecast::set_target(gcode::Heater heater, Celsius target) {
    Block& changed = block(heater);
    ++targets_.requests;
    if (changed.target_celsius != target.value()) same_targets_s_ = 0;
    changed.target_celsius = target.value();
    (heater == gcode::Heater::bed ? targets_.bed : targets_.hot_end) = target;
    control_.set_targets(targets_);
}

Celsius HeatForecast::reading(gcode::Heater heater) const {
    return Celsius{block(heater).state.sensor_celsius};
}

void HeatForecast::sample() {
    heat::HeatReadings readings;
    readings.hot_end = block(gcode::Heater::hot_end).shown();
    if (has_bed_) readings.bed = block(gcode::Heater::bed).shown();
    readings.step_pulses = ++pulses_;
    const heat::HeatDuties duties = control_.sample(now_, readings, false);
    now_ = now_ + from_seconds(kSample_s);
    block(gcode::Heater::hot_end).advance(duties.hot_end, room_celsius_, kSample_s);
    block(gcode::Heater::bed).advance(duties.bed, room_celsius_, kSample_s);
}

void HeatForecast::play(double duration_s) {
    played_s_ += duration_s;
    for (owed_s_ += duration_s; owed_s_ >= kSample_s; owed_s_ -= kSample_s) sample();
}

void HeatForecast::pass(double duration_s) {
    const double wanted_s = std::clamp(kSettled_s - same_targets_s_, 0.0, duration_s);
    const double played_s = played_s_ < kPlayed_s ? wanted_s : 0;
    same_targets_s_ += duration_s;
    play(played_s);
    if (duration_s <= played_s) return;
    for (Block& each : blocks_) each.settle(duration_s - played_s, room_celsius_);
}

double HeatForecast::wait(gcode::Heater heater, Celsius target, gcode::WaitFor direction) {
    wait_.begin(heater, target, direction);
    double waited_s = 0;
    if (played_s_ >= kPlayed_s) return waited_s;
    const auto is_over = [&] {
        const Celsius shown = block(heater).shown().value_or(reading(heater));
        return wait_.is_over(instant_from_ns(0) + from_seconds(waited_s), shown, *block(heater).config);
    };
    while (!is_over()) {
        if (waited_s >= kNever) return kNever;
        play(kRelease_s);
        same_targets_s_ += kRelease_s;
        waited_s += kRelease_s;
    }
    return waited_s;
}

}  // namespace qduino::printer::estimate
