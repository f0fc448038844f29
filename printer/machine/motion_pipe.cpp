#include "printer/machine/motion_pipe.h"

#include <cmath>

#include "printer/machine/vectors.h"

namespace qduino::printer::machine {

namespace {
bool is_long(const motion::Segment& segment) {
    return segment.end.ns_after(0) - segment.start.ns_after(0) >= to_ns(MotionPipe::kAhead);
}
}  // namespace

MotionPipe::MotionPipe(const MachineConfig& config, const std::atomic<std::uint32_t>& emergency)
    : planner_(motion::motion_settings(config), to_vector(home_positions(config))),
      excursion_(motion::motion_settings(config), to_vector(home_positions(config))),
      solver_(motion::motion_settings(config), to_vector(home_positions(config))),
      stops_(emergency),
      scale_(config),
      accelerations_{config.default_acceleration.value(), config.travel_acceleration.value(),
                     config.default_acceleration.value()} {}

void MotionPipe::pump(bool more_may_come) {
    if (stopping()) return;
    std::size_t budget = kEventsPerPump;
    if (played_out()) solved_.idle = true;
    const auto push = [this](const step::StepEvent& event) {
        if (solved_.idle) solved_.began_ns = event.time_ns;
        solved_.idle = false;
        solved_.until_ns = event.time_ns;
        const bool pushed = ring_.try_push(event);
        QDUINO_EXPECT(pushed);  // room was asked for below
    };
    while (budget > 0) {
        if (ahead() >= kAhead) return;
        // In slices, so that slow motion cannot run far past the mark.
        const std::size_t slice = std::min({budget, ring_.free(), std::size_t{128}});
        if (slice == 0) return;
        const std::size_t given = solver_.solve_some(slice, push);
        budget -= given;
        if (given == slice || !solver_.wants_segment()) continue;
        motion::Segment segment;
        if (planner().next(segment)) {
            solver_.load(segment);
            // What follows a long dwell is not begun before it must be: meanwhile the job may be
            // paused, or lose its heat.
            if (segment.kind == motion::SegmentKind::dwell && is_long(segment)) solver_.drain();
        } else if (planner().resting()) {
            if (solver_.tail_size() == 0) return;
            solver_.drain();
        } else if (more_may_come || ahead() >= kFlushBelow) {
            return;
        } else {
            planner().flush();
        }
    }
}

bool MotionPipe::played_out() const {
    return solver_.wants_segment() && solver_.tail_size() == 0 && seen_.events_taken == ring_.pushed() &&
           !seen_.moving;
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
}

void MotionPipe::change_limits(const gcode::LimitChange& change) {
    motion::MotionSettings settings = planner().settings();
    for (std::size_t i = 0; i < kAxisCount; ++i) {
        if (change.axis_acceleration[i]) settings.max_acceleration[i] = *change.axis_acceleration[i];
        if (change.axis_speed[i]) settings.max_speed[i] = *change.axis_speed[i];
        if (change.axis_instantaneous_speed[i]) {
            settings.instantaneous_speed[i] = *change.axis_instantaneous_speed[i];
        }
    }
    settings.square_corner_speed =
        std::min(settings.instantaneous_speed[Axis::x], settings.instantaneous_speed[Axis::y]);
    if (change.print_acceleration) accelerations_.print = change.print_acceleration->value();
    if (change.travel_acceleration) accelerations_.travel = change.travel_acceleration->value();
    if (change.filament_acceleration) accelerations_.filament = change.filament_acceleration->value();
    if (change.junction_deviation) {
        // δ back to the speed of a square corner (junction.h), at the acceleration now in force.
        settings.square_corner_speed = MillimetresPerSecond{
            std::sqrt(change.junction_deviation->value() * accelerations_.print / (std::sqrt(2.0) - 1))};
    }
    planner().set_settings(settings);
}

}  // namespace qduino::printer::machine
