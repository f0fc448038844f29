#include "printer/heat/heater_loop.h"

namespace qduino::printer::heat {
namespace {

PidGains gains_of(const HeaterConfig& config, PidGains manner) {
    manner.kp = config.kp;
    manner.ki = config.ki;
    manner.kd = config.kd;
    return manner;
}

}  // namespace

HeaterLoop::HeaterLoop(const HeaterWatch& watch, const PidGains& manner)
    : config_(watch.config()),
      manner_(manner),
      pid_(gains_of(config_, manner)),
      model_(config_.model),
      balance_(config_.model),
      watch_(watch) {}

void HeaterLoop::set(const HeaterSettings& settings) {
    apply(settings, config_);
    pid_ = Pid{gains_of(config_, manner_)};
    model_ = ModelControl{config_.model};
    balance_ = HeatBalance{config_.model};
}

void HeaterLoop::clear_faults() {
    watch_.clear();
    balance_.reset();
}

void HeaterLoop::check_balance(const Sample& sample, const HeaterDrive& drive) {
    if (config_.control != HeaterControl::model || sample.tuned) return balance_.reset();
    const HeatBalance::Verdict verdict = balance_.sample(sample.reading->value(), drive, sample.dt_s);
    watch_.take_balance(verdict, *sample.reading);
}

double HeaterLoop::sample(const Sample& sample) {
    const Celsius target = sample.cut ? Celsius{} : sample.target;
    reads_ = sample.reading.has_value();
    // a fault latches; it is asked for by watch()
    static_cast<void>(watch_.sample(sample.now, sample.reading, target));
    if (target != last_target_) {
        if (last_target_.value() <= 0) pid_.reset();
        last_target_ = target;
    }
    if (!reads_) return 0.0;
    shown_ = *sample.reading;
    const HeaterDrive drive{given_, sample.fan_duty, sample.flow_mm3_s, sample.room_celsius};
    check_balance(sample, drive);
    const double celsius = shown_.value();
    const double modelled = model_.update(
        {celsius, target.value(), given_, sample.dt_s, drive.fan_duty, drive.flow_mm3_s, drive.room_celsius});
    if (target.value() <= 0 || sample.tuned) return 0.0;
    if (config_.control == HeaterControl::model) return modelled;
    return pid_.update(target.value(), celsius, sample.dt_s);
}

}  // namespace qduino::printer::heat
