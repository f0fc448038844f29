#include "printer/machine/motion_pipe.h"

#include <algorithm>

#include "printer/motion/kinematics.h"

namespace qduino::printer::machine {

namespace {
motion::AxisVector home_positions(const MachineConfig& config) {
    motion::AxisVector home{};
    for (std::size_t i = 0; i < 3; ++i) home[i] = config.axes[i].home_position.value();
    return home;
}

bool is_long(const motion::Segment& segment) {
    return segment.end.ns_after(0) - segment.start.ns_after(0) >= to_ns(MotionPipe::kAhead);
}
}  // namespace

MotionPipe::MotionPipe(const MachineConfig& config, const std::atomic<std::uint32_t>& emergency)
    : planner_(motion::motion_settings(config), home_positions(config)),
      excursion_(motion::motion_settings(config), home_positions(config)),
      solver_(step::solver_settings(config), home_positions(config)),
      emergency_(emergency) {
    for (std::size_t i = 0; i < kAxisCount; ++i) steps_per_mm_[i] = config.axes[i].steps_per_mm;
}

void MotionPipe::pump(bool more_may_come) {
    if (stopping()) return;
    std::size_t budget = kEventsPerPump;
    if (played_out()) idle_ = true;
    const auto push = [this](const step::StepEvent& event) {
        if (idle_) began_ns_ = event.time_ns;
        idle_ = false;
        solved_until_ns_ = event.time_ns;
        static_cast<void>(ring_.try_push(event));  // room was asked for below
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
            // What follows a long dwell is not begun before it must be: meanwhile the job may be paused, or lose its heat.
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

void MotionPipe::request_stop() { stop_asked_.fetch_add(1, std::memory_order_release); }

void MotionPipe::reset(const motion::AxisVector& position_mm) {
    QDUINO_EXPECT(!stopping());
    // On the time line of whoever was planning: it never runs back.
    const motion::AxisVector position = position_mm;
    planner_.reset(position, planner().released_until());
    away_ = false;
    solver_.reset(position);
    idle_ = true;
    solved_until_ns_ = began_ns_ = seen_.timeline_ns;
}

motion::AxisVector MotionPipe::position_of_pulses(const std::array<std::int64_t, kAxisCount>& origin) const {
    motion::AxisVector motors_mm{};
    for (std::size_t i = 0; i < kAxisCount; ++i) {
        motors_mm[i] = static_cast<double>(seen_.steps[i] - origin[i]) / steps_per_mm_[i];
    }
    return motion::tool_from_motors(motors_mm);
}

}  // namespace qduino::printer::machine
