#include "printer/machine/motion_pipe.h"

#include "printer/machine/vectors.h"

namespace qduino::printer::machine {

namespace {
bool is_long(const motion::Segment& segment) {
    return segment.end.ns_after(0) - segment.start.ns_after(0) >= to_ns(MotionPipe::kLongDwell);
}
}  // namespace

MotionPipe::MotionPipe(const MachineConfig& config, const std::atomic<std::uint32_t>& emergency)
    : planner_(motion::motion_settings(config), to_vector(home_positions(config))),
      excursion_(motion::motion_settings(config), to_vector(home_positions(config))),
      solver_(motion::motion_settings(config), to_vector(home_positions(config))),
      stops_(emergency),
      scale_(config),
      correction_(config),
      accelerations_(accelerations_of(config)),
      compensation_(config) {}

std::size_t MotionPipe::pump(bool more_may_come, std::size_t events) {
    if (stopping()) return 0;
    if (played_out()) solved_.idle = true;
    const auto push = [this](const step::StepEvent& event) {
        if (solved_.idle) solved_.began_ns = event.time_ns;
        solved_.idle = false;
        solved_.until_ns = event.time_ns;
        const bool pushed = ring_.try_push(event);
        QDUINO_EXPECT(pushed);  // room was asked for below
    };
    while (events > 0) {
        if (ahead() >= kAhead) return 0;
        // In slices, so that slow motion cannot run far past the mark.
        const std::size_t slice = std::min({events, ring_.free(), std::size_t{128}});
        if (slice == 0) return 0;
        const std::size_t given = solver_.solve_some(slice, push);
        events -= given;
        if (given == slice || !solver_.wants_segment()) continue;
        motion::Segment segment;
        if (planner().next(segment, room_needed())) {
            solver_.load(segment);
            // What follows a long dwell is not begun before it must be: meanwhile the job may be
            // paused, or lose its heat.
            if (segment.kind == motion::SegmentKind::dwell && is_long(segment)) solver_.drain();
        } else if (planner().resting()) {
            if (solver_.gave_all()) return events;
            solver_.drain();
        } else if (more_may_come || ahead() >= kFlushBelow) {
            return events;
        } else {
            planner().flush();
        }
    }
    return 0;
}

bool MotionPipe::played_out() const {
    return solver_.gave_all() && seen_.events_taken == ring_.pushed() && !seen_.moving;
}

void MotionPipe::depart() {
    QDUINO_EXPECT(!away_ && planner_.stopped() && played_out());
    excursion_.set_settings(planner_.settings());
    excursion_.reset(planner_.held_position_mm(), planner_.released_until());
    away_ = true;
}

void MotionPipe::come_back() {
    QDUINO_EXPECT(away_ && drained());
    away_ = false;
    planner_.wait_until(excursion_.released_until());
    solver_.reset(planner_.held_position_mm());  // E counts from here again, whatever was pushed
}

bool MotionPipe::come_to_rest() {
    if (!planner().held()) planner().hold();
    return planner().stopped() && played_out();
}

void MotionPipe::reset(const motion::AxisVector& position_mm) {
    QDUINO_EXPECT(!stopping());
    // On the time line of whoever was planning: it never runs back.
    const motion::AxisVector position = position_mm;
    planner_.reset(position, planner().released_until());
    away_ = false;
    solver_.reset(position);
    solved_ = Solved{seen_.timeline_ns, seen_.timeline_ns, true};
    stops_.finished();
    // A change may have stood in the motion that is gone.
    compensation_.in_force(solver_.filters());
    append_filters();
}

void MotionPipe::settle_filament() {
    QDUINO_EXPECT(drained() && !stops_.running());
    motion::AxisVector at = planner().position_mm();
    at[Axis::e] = scale_.position_of(seen_.steps)[Axis::e];
    reset(at);
}

void MotionPipe::append_filters() {
    const std::optional<motion::MotionFilters> changed = compensation_.take_change();
    if (!changed) return;
    const bool fits = planner().append_filters(*changed);
    QDUINO_EXPECT(fits);
}

void MotionPipe::change_compensation(const gcode::CompensationChange& change) {
    QDUINO_EXPECT(!away_);
    compensation_.apply(change);
    motion::MotionSettings settings = planner_.settings();
    settings.pressure_advance = compensation_.advance();
    planner_.set_settings(settings);
    append_filters();
}

MotionPipe::Adjusted MotionPipe::adjusted() const {
    return {planner_.settings(),     accelerations_,         compensation_,     correction_.mesh(),
            correction_.uses_mesh(), correction_.fade_end(), correction_.skew()};
}

void MotionPipe::restore(const Adjusted& before) {
    planner_.set_settings(before.settings);
    accelerations_ = before.accelerations;
    compensation_.take(before.compensation);
    // Each of these takes the head to where it belongs then.
    if (correction_.mesh() != before.mesh) correction_.set_mesh(before.mesh);
    correction_.use_mesh(before.uses_mesh);
    if (correction_.fade_end() != before.fade_end_mm) correction_.set_fade_end(before.fade_end_mm);
    if (correction_.skew() != before.skew) correction_.set_skew(before.skew);
    // While a stop runs, what is appended would be dropped: reset() appends it.
    if (!stops_.running()) append_filters();
}

void MotionPipe::change_limits(const gcode::LimitChange& change) {
    motion::MotionSettings settings = planner().settings();
    apply(change, settings, accelerations_);
    planner().set_settings(settings);
}

}  // namespace qduino::printer::machine
