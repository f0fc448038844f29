#include "printer/heat/heat_control.h"

#include <algorithm>

namespace qduino::printer::heat {
namespace {
PidGains gains_of(const HeaterConfig& config) { return PidGains{config.kp, config.ki, config.kd}; }

/// A bed is slow and its gains are small, so its controller works from cold on (as Marlin's bed
/// control does).
PidGains bed_gains_of(const HeaterConfig& config) {
    PidGains gains = gains_of(config);
    gains.functional_range = 1000;
    gains.integrate_saturated = true;
    return gains;
}
}  // namespace

HeatControl::HeatControl(const MachineConfig& config, channel::FourSlot<link::HeatStatus>& service)
    : hot_end_{Pid{gains_of(config.hot_end)}, HeaterWatch{config.hot_end, "hot end"}, {}, {}, false},
      bed_{Pid{bed_gains_of(config.bed)}, HeaterWatch{config.bed, "bed"}, {}, {}, false},
      has_bed_(config.has_bed),
      idle_timeout_s_(config.idle_timeout.value()),
      idle_(config.idle_timeout.value()),
      status_({&for_loop_1_, &service}) {}

double HeatControl::drive(Heater& heater, Instant now, std::optional<Celsius> reading, Celsius target,
                          double dt_s, bool cut) {
    heater.reading = reading.has_value();
    if (reading) heater.shown = *reading;
    if (cut) target = Celsius{};
    // a fault latches; it is asked for below
    static_cast<void>(heater.watch.sample(now, reading, target));
    if (target != heater.last_target) {
        if (heater.last_target.value() <= 0) heater.pid.reset();
        heater.last_target = target;
    }
    if (cut || target.value() <= 0 || !reading) return 0.0;
    return heater.pid.update(target.value(), reading->value(), dt_s);
}

/// Asks the last sample which heaters are on their way to a target. One sample late is early
/// enough.
bool HeatControl::nobody_uses(Instant now, const HeatTargets& targets, std::uint64_t step_pulses) {
    const auto use_of = [](const Heater& heater, Celsius target) {
        return HeatUse::Heater{heater.shown.value(), target.value(), heater.watch.heating_up()};
    };
    return idle_.sample(
        now, {{use_of(hot_end_, targets.hot_end), use_of(bed_, targets.bed)}, step_pulses, targets.requests});
}

HeatDuties HeatControl::sample(Instant now, const HeatReadings& readings, bool cut) {
    HeatTargets targets = targets_.read();
    if (targets.clear_faults != cleared_) {
        cleared_ = targets.clear_faults;
        hot_end_.watch.clear();
        bed_.watch.clear();
    }
    const double dt_s = samples_ == 0 ? 0.008 : std::clamp(to_seconds(now - last_), 1e-4, 1.0);
    last_ = now;
    if (nobody_uses(now, targets, readings.step_pulses)) targets.hot_end = targets.bed = Celsius{};
    HeatDuties duties;
    duties.hot_end = drive(hot_end_, now, readings.hot_end, targets.hot_end, dt_s, cut);
    if (has_bed_) duties.bed = drive(bed_, now, readings.bed, targets.bed, dt_s, cut);
    // With one faulty sensor the machine is not what it seems: all heat goes off, and not only that
    // heater's.
    if (hot_end_.watch.faulted() || bed_.watch.faulted()) duties.hot_end = duties.bed = 0.0;
    duties.fan = std::clamp(targets.fan_duty, 0.0, 1.0);
    ++samples_;
    publish(targets, duties);
    return duties;
}

link::HeaterStatus HeatControl::status_of(const Heater& heater, Celsius target, double duty) {
    return {heater.shown.value(), target.value(), duty, heater.watch.faulted(), heater.reading};
}

void HeatControl::publish(const HeatTargets& targets, const HeatDuties& duties) {
    link::HeatStatus status;
    status.heartbeat = samples_;
    status.hot_end = status_of(hot_end_, targets.hot_end, duties.hot_end);
    status.bed = status_of(bed_, targets.bed, duties.bed);
    if (!has_bed_) status.bed.reading = true;  // none is missing
    status.fan_duty = duties.fan;
    status.fault = hot_end_.watch.faulted() ? hot_end_.watch.fault() : bed_.watch.fault();
    status.persists = hot_end_.watch.persists().empty() ? bed_.watch.persists() : hot_end_.watch.persists();
    status.idle_timeout_s = idle_timeout_s_;
    status.idle_left_s = idle_.left() ? to_seconds(*idle_.left()) : -1.0;
    status.idle_timed_out = idle_.timed_out();
    status.requests_seen = targets.requests;
    status_.write(status);
}

}  // namespace qduino::printer::heat
