#include "printer/heat/heat_control.h"

#include <algorithm>

namespace qduino::printer::heat {
namespace {
PidGains gains_of(const HeaterConfig& config) { return PidGains{config.kp, config.ki, config.kd}; }

/// A bed is slow and its gains are small: the controller works from cold on (as Marlin's bed control does).
PidGains bed_gains_of(const HeaterConfig& config) {
    PidGains gains = gains_of(config);
    gains.functional_range = 1000;
    gains.integrate_saturated = true;
    return gains;
}
}  // namespace

HeatControl::HeatControl(const MachineConfig& config)
    : hot_end_{Pid{gains_of(config.hot_end)}, HeaterWatch{config.hot_end, "hot end"}, {}, {}},
      bed_{Pid{bed_gains_of(config.bed)}, HeaterWatch{config.bed, "bed"}, {}, {}},
      has_bed_(config.has_bed) {}

double HeatControl::drive(Heater& heater, Instant now, std::optional<Celsius> reading, Celsius target,
                          double dt_s, bool cut) {
    if (reading) heater.shown = *reading;
    if (cut) target = Celsius{};
    static_cast<void>(heater.watch.sample(now, reading, target));  // it latches; asked for below
    if (target != heater.last_target) {
        if (heater.last_target.value() <= 0) heater.pid.reset();
        heater.last_target = target;
    }
    if (cut || target.value() <= 0 || !reading) return 0.0;
    return heater.pid.update(target.value(), reading->value(), dt_s);
}

HeatDuties HeatControl::sample(Instant now, const HeatReadings& readings, bool cut) {
    const HeatTargets targets = targets_.read();
    if (targets.clear_faults != cleared_) {
        cleared_ = targets.clear_faults;
        hot_end_.watch.clear();
        bed_.watch.clear();
    }
    const double dt_s = samples_ == 0 ? 0.008 : std::clamp(to_seconds(now - last_), 1e-4, 1.0);
    last_ = now;
    HeatDuties duties;
    duties.hot_end = drive(hot_end_, now, readings.hot_end, targets.hot_end, dt_s, cut);
    if (has_bed_) duties.bed = drive(bed_, now, readings.bed, targets.bed, dt_s, cut);
    // One faulty sensor says that the machine is not what it seems: all heat goes off, not only that
    // heater's.
    if (hot_end_.watch.faulted() || bed_.watch.faulted()) duties.hot_end = duties.bed = 0.0;
    duties.fan = std::clamp(targets.fan_duty, 0.0, 1.0);
    ++samples_;
    publish(targets, duties);
    return duties;
}

void HeatControl::publish(const HeatTargets& targets, const HeatDuties& duties) {
    link::HeatStatus status;
    status.heartbeat = samples_;
    status.hot_end = {hot_end_.shown.value(), targets.hot_end.value(), duties.hot_end,
                      hot_end_.watch.faulted()};
    status.bed = {bed_.shown.value(), targets.bed.value(), duties.bed, bed_.watch.faulted()};
    status.fan_duty = duties.fan;
    status.fault = hot_end_.watch.faulted() ? hot_end_.watch.fault() : bed_.watch.fault();
    status_.write(status);
    if (link_) link_->write(status);
}

}  // namespace qduino::printer::heat
