#include "printer/heat/heat_control.h"

#include <algorithm>

namespace qduino::printer::heat {
namespace {

/// A bed is slow and its gains are small, so its PID works from cold on (as Marlin's bed control
/// does).
constexpr PidGains kBedManner{.functional_range = 1000, .integrate_saturated = true};
/// A room is between these.
constexpr double kRoomAtLeast = 0;
constexpr double kRoomAtMost = 40;

}  // namespace

HeatControl::HeatControl(const MachineConfig& config, channel::FourSlot<link::HeatStatus>& service)
    : hot_end_(HeaterWatch{config.hot_end, "hot end"}, PidGains{}),
      bed_(HeaterWatch{config.bed, "bed"}, kBedManner),
      has_bed_(config.has_bed),
      idle_timeout_s_(config.idle_timeout.value()),
      idle_(config.idle_timeout.value()),
      flow_(config),
      room_celsius_(kRoomAtMost),
      status_({&for_loop_1_, &service}) {}

void HeatControl::take(const HeatTargets& targets) {
    if (targets.clear_faults != taken_.cleared) {
        taken_.cleared = targets.clear_faults;
        hot_end_.clear_faults();
        bed_.clear_faults();
    }
    if (targets.settings_number != taken_.settings) {
        taken_.settings = targets.settings_number;
        hot_end_.set(targets.hot_end_settings);
        bed_.set(targets.bed_settings);
    }
}

/// Begins an experiment that is newly asked for. One whose target is gone is over.
void HeatControl::follow_tuning(const HeatTargets& targets, bool cut) {
    const TuningRequest& asked = targets.tuning;
    if (asked.number != tuning_.report().number)
        tuning_.begin(asked, asked.of_bed ? bed_.config() : hot_end_.config());
    const Celsius target = asked.of_bed ? targets.bed : targets.hot_end;
    if (cut || faulted() || target != tuning_.target()) tuning_.stop("it was stopped");
    tuned_fan_.reset();
}

double HeatControl::drive(HeaterLoop& heater, std::optional<Celsius> reading, Celsius target,
                          const Surroundings& at) {
    HeaterLoop::Sample sample{.now = at.now,
                              .dt_s = at.dt_s,
                              .reading = reading,
                              .target = target,
                              .cut = at.cut,
                              .fan_duty = fan_duty_,
                              .flow_mm3_s = &heater == &hot_end_ ? at.flow_mm3_s : 0,
                              .room_celsius = room_celsius_};
    sample.tuned = &heater == &bed_ ? tuning_.runs_on_bed() : tuning_.runs_on_hot_end();
    if (!sample.tuned || !reading) return heater.sample(sample);
    const ModelTuning::Output output = tuning_.sample(*reading, heater.given(), at.dt_s);
    tuned_fan_ = output.fan;
    if (!output.heats) sample.target = Celsius{};  // the watch expects no heat yet
    static_cast<void>(heater.sample(sample));
    return output.duty;
}

/// Nothing is colder than the room: the coldest reading since the start stands for it.
void HeatControl::note_room(const HeatReadings& readings) {
    for (const std::optional<Celsius>& reading : {readings.hot_end, readings.bed}) {
        if (reading) room_celsius_ = std::min(room_celsius_, std::max(reading->value(), kRoomAtLeast));
    }
}

/// Asks the last sample which heaters are on their way to a target. One sample late is early
/// enough.
bool HeatControl::nobody_uses(Instant now, const HeatTargets& targets, std::uint64_t step_pulses) {
    const auto use_of = [](const HeaterLoop& heater, Celsius target, bool tuned) {
        return HeatUse::Heater{heater.shown().value(), target.value(), tuned || heater.watch().heating_up()};
    };
    return idle_.sample(now, {{use_of(hot_end_, targets.hot_end, tuning_.runs_on_hot_end()),
                               use_of(bed_, targets.bed, tuning_.runs_on_bed())},
                              step_pulses,
                              targets.requests});
}

HeatDuties HeatControl::sample(Instant now, const HeatReadings& readings, bool cut) {
    HeatTargets targets = targets_.read();
    take(targets);
    const double dt_s = taken_.samples == 0 ? 0.008 : std::clamp(to_seconds(now - taken_.last), 1e-4, 1.0);
    taken_.last = now;
    follow_tuning(targets, cut);
    if (nobody_uses(now, targets, readings.step_pulses)) targets.hot_end = targets.bed = Celsius{};
    note_room(readings);
    const Surroundings at{now, dt_s, flow_.sample(readings.filament_steps, dt_s), cut};
    HeatDuties duties;
    duties.hot_end = drive(hot_end_, readings.hot_end, targets.hot_end, at);
    if (has_bed_) duties.bed = drive(bed_, readings.bed, targets.bed, at);
    // With one faulty sensor the machine is not what it seems: all heat goes off, and not only that
    // heater's.
    if (cut || faulted()) duties.hot_end = duties.bed = 0.0;
    hot_end_.give(duties.hot_end);
    bed_.give(duties.bed);
    duties.fan = fan_duty_ = std::clamp(tuned_fan_.value_or(targets.fan_duty), 0.0, 1.0);
    ++taken_.samples;
    publish(targets, duties);
    return duties;
}

link::HeaterStatus HeatControl::status_of(const HeaterLoop& heater, Celsius target, double duty) {
    return {heater.shown().value(), target.value(), duty, heater.watch().faulted(), heater.reads()};
}

void HeatControl::publish(const HeatTargets& targets, const HeatDuties& duties) {
    const HeaterWatch& hot_end = hot_end_.watch();
    const HeaterWatch& bed = bed_.watch();
    link::HeatStatus status;
    status.heartbeat = taken_.samples;
    status.hot_end = status_of(hot_end_, targets.hot_end, duties.hot_end);
    status.bed = status_of(bed_, targets.bed, duties.bed);
    if (!has_bed_) status.bed.reading = true;  // none is missing
    status.fan_duty = duties.fan;
    status.fault = hot_end.faulted() ? hot_end.fault() : bed.fault();
    status.persists = hot_end.persists().empty() ? bed.persists() : hot_end.persists();
    status.idle_timeout_s = idle_timeout_s_;
    status.idle_left_s = idle_.left() ? to_seconds(*idle_.left()) : -1.0;
    status.idle_timed_out = idle_.timed_out();
    status.requests_seen = targets.requests;
    status_.write(status);
    tuning_report_.write(tuning_.report());
}

}  // namespace qduino::printer::heat
