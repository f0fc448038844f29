#include "printer/step/path_solver.h"

#include <algorithm>
#include <cmath>

#include "base/contract.h"

namespace qduino::printer::step {
namespace {

double seconds_between(const motion::TimelineInstant& from, const motion::TimelineInstant& to) {
    return (static_cast<double>(to.ns - from.ns) + (to.fraction_ns - from.fraction_ns)) * 1e-9;
}

std::int64_t ns_above(double seconds) { return static_cast<std::int64_t>(std::ceil(seconds * 1e9)); }

}  // namespace

PathSolver::PathSolver(const motion::MotionSettings& settings) : settings_(settings) {
    set_filters(settings.filters);
}

void PathSolver::set_filters(const motion::MotionFilters& filters) {
    QDUINO_EXPECT(idle_);
    future_ns_ = past_ns_ = 0;
    for (std::size_t motor = 0; motor < kAxisCount; ++motor) {
        paths_[motor].configure(settings_, filters, motor);
        future_ns_ = std::max(future_ns_, ns_above(paths_[motor].future_s()));
        past_ns_ = std::max(past_ns_, ns_above(paths_[motor].past_s()));
    }
}

void PathSolver::begin(const motion::AxisVector& at_mm, const Counts& counts,
                       const motion::TimelineInstant& start) {
    QDUINO_EXPECT(idle_);
    idle_ = false;
    counts_ = counts;
    zero_ = start;
    zero_.ns -= future_ns_;
    track_.begin(at_mm, static_cast<double>(-past_ns_) * 1e-9, static_cast<double>(future_ns_) * 1e-9);
    for (std::size_t motor = 0; motor < kAxisCount; ++motor) {
        paths_[motor].begin(track_, 0);
        searches_[motor].begin({}, 0);
        next_s_[motor] = kNever_s;
        blocked_[motor] = true;
    }
    more_ = true;
}

void PathSolver::append(const motion::Segment& segment, const motion::TimelineInstant& start) {
    track_.append(segment, seconds_between(zero_, start));
    more_ = true;
}

bool PathSolver::has_room() {
    if (idle_ || track_.size() < MotionTrack::kCapacity / 4) return true;
    std::uint64_t oldest = ~std::uint64_t{0};
    for (const MotorPath& path : paths_) oldest = std::min(oldest, path.oldest());
    track_.drop_before(oldest);
    return track_.has_room();
}

void PathSolver::settle() {
    QDUINO_EXPECT(!idle_ && !settling_);
    const std::int64_t reach_ns = past_ns_ + future_ns_ + to_ns(settings_.reversal_gap);
    track_.rest(static_cast<double>(reach_ns) * 1e-9);
    settling_ = more_ = true;
}

void PathSolver::find(std::size_t motor) {
    const bool was_blocked = blocked_[motor];
    find_in_path(motor);
    if (!was_blocked && !blocked_[motor]) return;
    blocked_until_s_ = kNever_s;
    for (std::size_t each = 0; each < kAxisCount; ++each)
        if (blocked_[each]) blocked_until_s_ = std::min(blocked_until_s_, paths_[each].end_s());
}

void PathSolver::find_in_path(std::size_t motor) {
    double after_s = 0;
    blocked_[motor] = false;
    while ((ways_[motor] = searches_[motor].next(counts_[motor], after_s)) == 0) {
        if (!paths_[motor].next(track_)) {
            blocked_[motor] = true;
            next_s_[motor] = kNever_s;
            return;
        }
        searches_[motor].begin(paths_[motor].steps(), paths_[motor].end_s() - paths_[motor].start_s());
    }
    next_s_[motor] = paths_[motor].start_s() + after_s;
}

PathSolver::Found PathSolver::next(Crossing& found) {
    if (more_) {
        for (std::size_t motor = 0; motor < kAxisCount; ++motor)
            if (blocked_[motor]) find(motor);
        more_ = false;
    }
    const std::size_t motor = earliest();
    const double at_s = next_s_[motor];
    if (blocked_until_s_ < at_s) return settling_ ? finish(found) : Found::blocked;
    found = {to_timeline_ns(at_s), static_cast<int>(motor), ways_[motor]};
    find(motor);
    return Found::step;
}

/// All motors rest. A sum of shares that is a rounding error beside a half-step may have been
/// rounded the other way.
PathSolver::Found PathSolver::finish(Crossing& found) {
    const motion::AxisVector end_mm = settings_.kinematics.motors_from_tool(track_.end_mm());
    for (std::size_t motor = 0; motor < kAxisCount; ++motor) {
        const std::int64_t left = whole_steps(end_mm[motor] * settings_.steps_per_mm[motor]) - counts_[motor];
        if (left == 0) continue;
        found = {known_until_ns(), static_cast<int>(motor), left > 0 ? 1 : -1};
        counts_[motor] += found.way;
        return Found::step;
    }
    idle_ = true;
    settling_ = false;
    return Found::settled;
}

std::int64_t PathSolver::known_until_ns() const {
    double known_s = kNever_s;
    for (std::size_t motor = 0; motor < kAxisCount; ++motor)
        known_s = std::min(known_s, blocked_[motor] ? paths_[motor].end_s() : next_s_[motor]);
    return to_timeline_ns(std::max(known_s, 0.0));
}

}  // namespace qduino::printer::step
