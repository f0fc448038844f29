#include "twin/job.h"

#include <algorithm>
#include <utility>

namespace qduino::twin {
namespace {

// In this many extruder steps a temperature moves by less than a tenth of a degree.
constexpr std::uint64_t kStepsPerSample = 16;

AxisCounters difference(const AxisCounters& now, const AxisCounters& then) {
    return {now.moved - then.moved, now.lost_pull_out - then.lost_pull_out,
            now.lost_hard_stop - then.lost_hard_stop, now.lost_timing - then.lost_timing,
            now.ignored_disabled - then.ignored_disabled};
}

void widen(TemperatureRange& range, double celsius) {
    range.minimum_celsius = std::min(range.minimum_celsius, celsius);
    range.maximum_celsius = std::max(range.maximum_celsius, celsius);
}

}  // namespace

Job::Job(Printer& printer, std::unique_ptr<ByteSource> asked, Instant now,
         const std::optional<InspectionStart>& before)
    : printer_(printer),
      asked_(std::move(asked)),
      began_(now),
      at_begin_(printer.state(now)),
      inspector_(printer.machine(), *asked_, start_for(printer, now, before)),
      deposit_(printer.machine(), at_begin_.position_steps[kExtruder]),
      gantry_(printer.machine()),
      position_(at_begin_.position_steps) {
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
        mm_per_step_[axis] = 1.0 / printer.machine().axes[axis].steps_per_mm;
    for (const ExtraMotorSpec& spec : printer.machine().extra_motors) {
        const std::int64_t extra = printer.extra_position(racking_.size());
        racking_.emplace_back(spec, extra - position_[spec.slide]);
    }
    printer_.observe(this);
}

Job::~Job() {
    if (watching_) printer_.observe(nullptr);
}

// Somebody may have jogged between jobs: an axis that is not where the last job left it begins
// where it stands. Filament always does: no switch gives it a place, so a job counts it from the
// step that the motor is on. Else what is left of a step would add up from job to job.
InspectionStart Job::start_for(Printer& printer, Instant now, const std::optional<InspectionStart>& before) {
    const PrinterState state = printer.state(now);
    if (!before) return InspectionStart::at_power_on(printer.machine(), state.position_steps, state.pressed);
    InspectionStart start = *before;
    Position motors{};
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
        motors[axis] = (static_cast<double>(state.position_steps[axis]) - start.origin[axis]) /
                       printer.machine().axes[axis].steps_per_mm;
    const Gantry gantry{printer.machine()};
    const Position there = gantry.nozzle_at(motors);
    std::uint8_t jogged = 0;
    for (std::size_t axis = 0; axis < kSlideCount; ++axis)
        if (start.built[axis] != state.position_steps[axis])
            jogged = static_cast<std::uint8_t>(jogged | gantry.slides_of(axis));
    if (jogged != 0 && !gantry.is_linear()) jogged = 0b111;
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
        const bool moved = axis == kExtruder || (jogged >> axis & 1u) != 0;
        start.built[axis] = state.position_steps[axis];
        if (moved) start.asked_mm[axis] = there[axis];
    }
    start.pressed = state.pressed;
    return start;
}

void Job::on_step(const StepSeen& step) {
    inspector_.on_step(step);
    position_[step.axis] = step.position;
    if (record_) record_->on_step(step, inspector_);
    if (step.axis != kExtruder) {
        for (std::size_t which = 0; which < racking_.size(); ++which)
            if (racking_[which].slide() == step.axis) watch_racking(which);
        return;
    }
    // Filament pushed away from the path is no part of the print; E counts on from where it left.
    if (!inspector_.away()) {
        Position motors{};
        for (std::size_t axis = 0; axis < kAxisCount; ++axis)
            motors[axis] = static_cast<double>(position_[axis]) * mm_per_step_[axis];
        const Position nozzle = gantry_.nozzle_at(motors);
        deposit_.extruder_at(step.position - inspector_.pushed_away(),
                             {nozzle[0], nozzle[1], nozzle[2] - inspector_.lift_by_bed(nozzle)});
    }
    if (step.direction < 0) return;
    if (pushed_++ % kStepsPerSample == 0) sample_temperatures(step.at);
    if (too_cold_) ++cold_;
}

std::int64_t Job::apart(std::size_t which) const {
    return printer_.extra_position(which) - position_[racking_[which].slide()];
}

void Job::watch_racking(std::size_t which) {
    const bool homing = (inspector_.homing() >> racking_[which].slide() & 1u) != 0;
    racking_[which].on_step(apart(which), homing);
}

void Job::on_extra_step(std::size_t which, std::int64_t) { watch_racking(which); }

void Job::sample_temperatures(Instant at) {
    const double hot_end = printer_.sensor_celsius(at, kHotEnd);
    too_cold_ = hot_end < printer_.machine().minimum_extrude_celsius;
    if (record_) record_->set_hot(at, !too_cold_);
    widen(hot_end_, hot_end);
    widen(bed_, printer_.sensor_celsius(at, kBed));
}

Report Job::finish(Instant now, bool read_rest, std::uint64_t excursions_told) {
    printer_.observe(nullptr);
    watching_ = false;
    deposit_.finish();
    const PrinterState state = printer_.state(now);
    Report report{.differences = {},
                  .findings = inspector_.finish(now, read_rest),
                  .excursions_told = excursions_told,
                  .racking = {},
                  .timing_violations = state.timing_violations - at_begin_.timing_violations,
                  .cold_extrusion_steps = cold_,
                  .extruded = pushed_ > 0,
                  .hot_end = hot_end_,
                  .bed = bed_,
                  .duration_s = to_seconds(now - began_),
                  .volume_mm3 = deposit_.volume_mm3(),
                  .layers_merged = deposit_.layers_merged(),
                  .layers = deposit_.layers()};
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
        report.counters[axis] = difference(state.counters[axis], at_begin_.counters[axis]);
        report.lost_steps[axis] = report.counters[axis].lost();
        AxisFindings& found = report.findings.axes[axis];
        if (axis >= kSlideCount || !found.homed) continue;
        const Slide& slide = printer_.slide(axis);
        found.homing_error_mm = slide.to_mm(inspector_.homed_at()[axis] - slide.trigger());
    }
    for (std::size_t which = 0; which < racking_.size(); ++which) {
        racking_[which].finish(apart(which));
        report.racking.push_back(racking_[which]);
    }
    judge(report, printer_.machine());
    return report;
}

}  // namespace qduino::twin
