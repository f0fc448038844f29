#include "printer/machine/heating.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace qduino::printer::machine {

Heating::Heating(const MachineConfig& config, channel::FourSlot<link::HeatStatus>& published)
    : config_(config), control_(config, published), minimum_extrude_(config.minimum_extrude) {
    kept_settings_ = {0, settings_of(config.hot_end), settings_of(config.bed)};
    targets_.hot_end_settings = kept_settings_.hot_end;
    targets_.bed_settings = kept_settings_.bed;
}

// ---- what is heard ------------------------------------------------------------------------------

void Heating::observe(Instant now) {
    const link::HeatStatus fresh = control_.status();
    if (!alive_ || fresh.heartbeat != seen_.heartbeat) alive_ = now;
    seen_ = fresh;
    silent_ = now - *alive_ > kSilence;
}

std::string_view Heating::fault() const {
    if (!seen_.fault.empty()) return seen_.fault;
    if (silent_) return "the heater loop (loop 3) has stopped sampling: heat is off; restart the sketch";
    return {};
}

std::string_view Heating::persisting_fault() const {
    if (silent_) return "the heater loop (loop 3) does not sample: restart the sketch";
    return seen_.persists.view();
}

bool Heating::idle_lost() const {
    const bool asked = targets_.hot_end.value() > 0 || targets_.bed.value() > 0;
    return asked && seen_.idle_timed_out && seen_.requests_seen == targets_.requests;
}

Result<void> Heating::check_cold(double filament_mm) const {
    if (filament_mm == 0 || may_extrude(config_, minimum_extrude_, Celsius{seen_.hot_end.celsius})) return {};
    // Rounded down: 168.96 °C is below 169 °C, and must not be told as 169.
    const double told = std::floor(seen_.hot_end.celsius * 10) / 10;
    return make_error(ErrorCode::out_of_range, "the hot end is at ", Fixed{told, 1},
                      " °C: filament moves only from ", Shortest{minimum_extrude_.value()},
                      " °C on; heat it first (M109)");
}

// ---- what is asked ------------------------------------------------------------------------------

void Heating::set_target(gcode::Heater heater, Celsius target) {
    (heater == gcode::Heater::hot_end ? targets_.hot_end : targets_.bed) = target;
    note_request(heater, target);
    control_.set_targets(targets_);
}

bool Heating::takes_heat(gcode::Heater heater, Celsius target) const {
    const bool hot_end = heater == gcode::Heater::hot_end;
    const double in_force = (hot_end ? targets_.hot_end : targets_.bed).value();
    const double needed = config_.minimum_extrude.value();
    const bool off = target.value() <= 0 && in_force > 0;
    return off || (hot_end && target.value() < needed && in_force >= needed);
}

/// While targets are kept: off means off for now, and what is warm enough to go on with is taken
/// over.
void Heating::note_request(gcode::Heater heater, Celsius target) {
    ++targets_.requests;
    if (!kept_ || target.value() <= 0) return;
    if (heater == gcode::Heater::bed) {
        kept_->bed = target;
        return;
    }
    const double needed = minimum_extrude_.value();
    if (target.value() >= needed || kept_->hot_end.value() < needed) kept_->hot_end = target;
}

void Heating::clear_faults() {
    ++targets_.clear_faults;
    all_off();
    seen_.fault.clear();
}

// ---- the heaters' numbers -----------------------------------------------------------------------

void Heating::change(gcode::Heater heater, const gcode::HeaterChange& change) {
    HeaterSettings& settings =
        heater == gcode::Heater::bed ? targets_.bed_settings : targets_.hot_end_settings;
    settings.kp = change.kp.value_or(settings.kp);
    settings.ki = change.ki.value_or(settings.ki);
    settings.kd = change.kd.value_or(settings.kd);
    HeaterModel& model = settings.model;
    model.power_w = change.power_w.value_or(model.power_w);
    model.heat_capacity_j_k = change.heat_capacity_j_k.value_or(model.heat_capacity_j_k);
    model.sensor_lag_s = change.sensor_lag_s.value_or(model.sensor_lag_s);
    model.filament_j_mm3_k = change.filament_j_mm3_k.value_or(model.filament_j_mm3_k);
    model.loss_w_k = change.loss_w_k.value_or(model.loss_w_k);
    if (change.loss_with_fan_w_k)
        model.fan_loss_w_k = std::max(*change.loss_with_fan_w_k - model.loss_w_k, 0.0);
    ++targets_.settings_number;
    control_.set_targets(targets_);
}

link::KeptHeat Heating::keep_settings() {
    kept_settings_ = {kept_settings_.number + 1, targets_.hot_end_settings, targets_.bed_settings};
    return kept_settings_;
}

void Heating::take_settings(const HeaterSettings& hot_end, const HeaterSettings& bed) {
    targets_.hot_end_settings = hot_end;
    targets_.bed_settings = bed;
    ++targets_.settings_number;
    control_.set_targets(targets_);
}

/// Control begins anew with its numbers, so the same ones are not set again.
void Heating::restore(const Adjusted& numbers) {
    minimum_extrude_ = config_.minimum_extrude;
    const bool same = numbers.hot_end == targets_.hot_end_settings && numbers.bed == targets_.bed_settings;
    if (!same) take_settings(numbers.hot_end, numbers.bed);
}

std::optional<Heating::TuningOver> Heating::advance_tuning() {
    if (!tuning_) return std::nullopt;
    const gcode::TuningAsked asked = tuning_->asked;
    const bool of_bed = asked.heater == gcode::Heater::bed;
    if (!std::exchange(tuning_->begun, true)) {
        const std::uint32_t number = targets_.tuning.number + 1;
        targets_.tuning = {number, asked.kind, of_bed, asked.target, asked.swings};
        set_target(asked.heater, asked.target);
        return std::nullopt;
    }
    const heat::TuningReport report = control_.tuning();
    const bool over = report.state == heat::TuningState::done || report.state == heat::TuningState::failed;
    if (report.number != targets_.tuning.number || !over) return std::nullopt;
    tuning_.reset();
    if (asked.use && report.state == heat::TuningState::done) {
        (of_bed ? targets_.bed_settings : targets_.hot_end_settings) = report.found;
        ++targets_.settings_number;
    }
    set_target(asked.heater, Celsius{});
    return TuningOver{asked, report};
}

// ---- while a job is paused ----------------------------------------------------------------------

void Heating::keep_targets() {
    if (!kept_) kept_ = Kept{targets_.hot_end, targets_.bed};
}

bool Heating::may_extrude_now_and_later() const {
    QDUINO_EXPECT(kept_.has_value());
    return seen_.hot_end.reading && may_extrude(config_, minimum_extrude_, Celsius{seen_.hot_end.celsius}) &&
           kept_->hot_end >= minimum_extrude_;
}

void Heating::ask_for_kept() {
    QDUINO_EXPECT(kept_.has_value());
    targets_.hot_end = kept_->hot_end;
    targets_.bed = kept_->bed;
    ++targets_.requests;
    control_.set_targets(targets_);
}

bool Heating::is_warm_again() const {
    const auto warm = [](const link::HeaterStatus& seen, Celsius target, const HeaterConfig& config) {
        return target.value() <= 0 || seen.celsius >= content_from(config, target).value();
    };
    return warm(seen_.hot_end, targets_.hot_end, config_.hot_end) &&
           warm(seen_.bed, targets_.bed, config_.bed);
}

gcode::Heater Heating::coldest() const {
    const auto lacks = [](const link::HeaterStatus& seen, Celsius target) {
        return target.value() > 0 ? target.value() - seen.celsius : -1e9;
    };
    const bool bed = lacks(seen_.bed, targets_.bed) > lacks(seen_.hot_end, targets_.hot_end);
    return bed ? gcode::Heater::bed : gcode::Heater::hot_end;
}

// ---- while a job waits for heat -----------------------------------------------------------------

void Heating::advance_wait(Instant now) {
    if (!wait_.active()) return;
    const bool hot_end = wait_.heater() == gcode::Heater::hot_end;
    const double celsius = hot_end ? seen_.hot_end.celsius : seen_.bed.celsius;
    wait_.is_over(now, Celsius{celsius}, hot_end ? config_.hot_end : config_.bed);
}

}  // namespace qduino::printer::machine
