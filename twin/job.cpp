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
      position_(at_begin_.position_steps) {
    for (std::size_t axis = 0; axis < kSlideCount; ++axis)
        mm_per_step_[axis] = 1.0 / printer.machine().axes[axis].steps_per_mm;
    printer_.observe(this);
}

Job::~Job() {
    if (watching_) printer_.observe(nullptr);
}

// Somebody may have jogged between jobs: an axis that is not where the last job left it begins
// where it stands.
InspectionStart Job::start_for(Printer& printer, Instant now, const std::optional<InspectionStart>& before) {
    const PrinterState state = printer.state(now);
    if (!before) return InspectionStart::at_power_on(state.position_steps, state.pressed);
    InspectionStart start = *before;
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
        if (start.built[axis] == state.position_steps[axis]) continue;
        start.built[axis] = state.position_steps[axis];
        start.asked_mm[axis] = (static_cast<double>(start.built[axis]) - start.origin[axis]) /
                               printer.machine().axes[axis].steps_per_mm;
    }
    start.pressed = state.pressed;
    return start;
}

void Job::on_step(const StepSeen& step) {
    inspector_.on_step(step);
    position_[step.axis] = step.position;
    if (step.axis != kExtruder) return;
    // Filament pushed away from the path is no part of the print; E counts on from where it left.
    if (!inspector_.away()) {
        const auto at = [this](int axis) {
            return static_cast<double>(position_[axis]) * mm_per_step_[axis];
        };
        deposit_.extruder_at(step.position - inspector_.pushed_away(), {at(0), at(1), at(2)});
    }
    if (step.direction < 0) return;
    if (pushed_++ % kStepsPerSample == 0) sample_temperatures(step.at);
    if (too_cold_) ++cold_;
}

void Job::sample_temperatures(Instant at) {
    const double hot_end = printer_.sensor_celsius(at, kHotEnd);
    too_cold_ = hot_end < printer_.machine().minimum_extrude_celsius;
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
        const std::int64_t off =
            inspector_.homed_at()[axis] - printer_.axis(static_cast<int>(axis)).trigger();
        found.homing_error_mm = static_cast<double>(off) * mm_per_step_[axis];
    }
    judge(report, printer_.machine());
    return report;
}

}  // namespace qduino::twin
