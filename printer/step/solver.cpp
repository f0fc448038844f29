#include "printer/step/solver.h"

#include <cmath>

#include "base/contract.h"

namespace qduino::printer::step {
namespace {

constexpr std::int64_t kLongAgo = std::numeric_limits<std::int64_t>::min() / 2;

}  // namespace

Solver::Solver(const motion::MotionSettings& settings, const motion::AxisVector& position_mm)
    : settings_(settings),
      filters_(settings.filters),
      interval_ns_(to_ns(settings.step_interval_min)),
      gap_ns_(to_ns(std::max(settings.reversal_gap, settings.step_interval_min))),
      path_(settings) {
    reset(position_mm);
}

void Solver::reset(const motion::AxisVector& position_mm) {
    const motion::AxisVector motors_mm = settings_.kinematics.motors_from_tool(position_mm);
    for (std::size_t i = 0; i < kAxisCount; ++i) {
        counts_[i] = whole_steps(motors_mm[i] * settings_.steps_per_mm[i]);
        tracks_[i] = Track{};
    }
    last_ns_.fill(kLongAgo);
    before_last_ns_.fill(kLongAgo);
    last_way_.fill(0);
    next_ns_.fill(kNever);
    end_ns_ = last_event_ns_ = filters_ran_until_ns_ = kLongAgo;
    tail_.clear();
    markers_.clear();
    path_.stop();
    solving_ = draining_ = ends_at_rest_ = has_behind_ = drains_behind_ = false;
}

void Solver::load(const motion::Segment& segment) {
    QDUINO_EXPECT(wants_segment());
    draining_ = drains_behind_ = false;
    const bool filtered = filters_.active() || settings_.jerk_mm_s3 > 0 || !settings_.kinematics.is_linear();
    if (!path_.idle() || (filtered && segment.kind == motion::SegmentKind::move)) return load_path(segment);
    end_ns_ = std::max(end_ns_, segment.end.ns_after(0) + shift_ns_);
    if (segment.kind == motion::SegmentKind::move) return load_move(segment);
    load_event(segment);
}

/// Contract: the motors stand, or the segment is a marker.
void Solver::load_event(const motion::Segment& segment) {
    switch (segment.kind) {
        case motion::SegmentKind::move:
            break;
        case motion::SegmentKind::dwell:
            keep_event(EventKind::rest, 0, 0);  // at its end: until then it has not been played
            break;
        case motion::SegmentKind::marker:
            keep_event(EventKind::marker, 0, segment.value);
            break;
        case motion::SegmentKind::homing:
            keep_event(EventKind::homing, static_cast<int>(segment.axis), segment.value);
            break;
        case motion::SegmentKind::filters:
            filters_ = segment.filters;
            path_.set_filters(filters_);
            break;
    }
}

void Solver::keep_event(EventKind kind, int axis, std::uint32_t value) {
    last_event_ns_ = std::max(last_event_ns_, end_ns_);
    tail_.push({last_event_ns_, kind, static_cast<std::uint8_t>(axis), 1, 0, value});
}

void Solver::drain() {
    draining_ = path_.idle();
    drains_behind_ = true;
    if (draining_ || path_.settling()) return;
    path_.settle();
    solving_ = true;
}

/// A step there and this one back: neither is made.
bool Solver::drops_pair(int axis, int direction, std::int64_t time_ns) {
    if (last_way_[axis] == direction || !tail_.take_back(axis, direction, time_ns, gap_ns_)) return false;
    last_ns_[axis] = before_last_ns_[axis];
    last_way_[axis] = 0;
    ++pairs_dropped_;
    return true;
}

// ---- in proportion to the way: closed form ------------------------------------------------------

void Solver::load_move(const motion::Segment& segment) {
    shape_ = segment.shape;
    start_ = segment.start;
    start_.ns += shift_ns_;
    // Filters that are switched off have run out behind the plan's end.
    start_.ns += shift_to(start_.ns, filters_ran_until_ns_);
    end_ns_ = std::max(end_ns_, segment.end.ns_after(0) + shift_ns_);
    ends_at_rest_ = segment.shape.exit_speed_mm_s == 0;
    const motion::AxisVector from_mm = settings_.kinematics.motors_from_tool(segment.start_mm);
    const motion::AxisVector to_mm = settings_.kinematics.motors_from_tool(segment.end_mm);
    for (int i = 0; i < kAxisCount; ++i) {
        const double steps_per_mm = settings_.steps_per_mm[i];
        load_track(i, from_mm[i] * steps_per_mm, to_mm[i] * steps_per_mm);
        Track& track = tracks_[i];
        while (track.done < track.total && drops_pair(i, track.direction, crossing_ns(track))) ++track.done;
        if (track.done < track.total) last_way_[i] = track.direction;
        find_next(i);
    }
    solving_ = true;
}

void Solver::load_track(int axis, double start_steps, double end_steps) {
    Track& track = tracks_[axis];
    track = Track{};
    const std::int64_t target = whole_steps(end_steps);
    const std::int64_t change = target - counts_[axis];
    if (change == 0) return;
    const double span_steps = end_steps - start_steps;
    // Otherwise the segment does not begin where the last one ended.
    QDUINO_EXPECT((change > 0) == (span_steps > 0));
    track.direction = change > 0 ? 1 : -1;
    track.total = change > 0 ? change : -change;
    const double first_crossing = static_cast<double>(counts_[axis]) + 0.5 * track.direction;
    track.first_mm = (first_crossing - start_steps) / span_steps * shape_.length_mm;
    track.stride_mm = shape_.length_mm / std::abs(span_steps);
    counts_[axis] = target;
}

// ---- any other motion: polynomials of the time --------------------------------------------------

void Solver::load_path(const motion::Segment& segment) {
    motion::TimelineInstant start = segment.start;
    start.ns += shift_ns_;
    if (segment.kind == motion::SegmentKind::marker) {
        if (markers_.full()) pass_markers(markers_.front().time_ns);
        markers_.push({start.ns_after(0) + path_.past_ns(), segment.value});
        return;
    }
    solving_ = true;
    if (segment.kind != motion::SegmentKind::move) {
        path_.settle();
        behind_ = segment;
        has_behind_ = true;
        return;
    }
    if (path_.idle()) {
        // The motors move before the plan does, and not before what they last did is done.
        start.ns += shift_to(start.ns - path_.future_ns(), std::max<std::int64_t>(last_event_ns_, 0));
        path_.begin(segment.start_mm, counts_, start);
    }
    path_.append(segment, start);
}

/// What is known of the motion now: one step, or its end.
void Solver::solve_path() {
    PathSolver::Crossing crossing;
    const PathSolver::Found found = path_.next(crossing);
    if (found == PathSolver::Found::step) return take_crossing(crossing);
    end_ns_ = std::max(end_ns_, path_.known_until_ns());
    pass_markers(end_ns_);
    solving_ = false;
    if (found == PathSolver::Found::blocked) return;
    counts_ = path_.counts();
    pass_markers(kNever);
    keep_event(EventKind::rest, 0, 0);
    draining_ = drains_behind_;
    if (has_behind_) {
        has_behind_ = false;
        end_ns_ = std::max(end_ns_, behind_.end.ns_after(0) + shift_ns_);
        load_event(behind_);
        last_event_ns_ = std::max(last_event_ns_, end_ns_);
    }
    filters_ran_until_ns_ = last_event_ns_;
}

/// How much later than planned a motion must begin, so that it leaves the time line of what was
/// before it alone.
std::int64_t Solver::shift_to(std::int64_t begin_ns, std::int64_t free_from_ns) {
    const std::int64_t early_ns = std::max<std::int64_t>(free_from_ns - begin_ns, 0);
    shift_ns_ += early_ns;
    return early_ns;
}

void Solver::take_crossing(const PathSolver::Crossing& crossing) {
    const int axis = crossing.motor;
    end_ns_ = std::max(end_ns_, crossing.time_ns);
    pass_markers(crossing.time_ns);
    if (drops_pair(axis, crossing.way, crossing.time_ns)) return;
    std::int64_t ns = crossing.time_ns;
    if (ns < last_ns_[axis] + interval_ns_) [[unlikely]] {
        ns = last_ns_[axis] + interval_ns_;
        ++steps_delayed_;
    }
    last_event_ns_ = std::max(last_event_ns_, ns);
    before_last_ns_[axis] = last_ns_[axis];
    last_ns_[axis] = last_event_ns_;
    last_way_[axis] = static_cast<std::int8_t>(crossing.way);
    tail_.push({last_event_ns_, EventKind::step, static_cast<std::uint8_t>(axis), last_way_[axis], 0, 0});
}

void Solver::pass_markers(std::int64_t until_ns) {
    for (; !markers_.empty() && markers_.front().time_ns <= until_ns; markers_.pop()) {
        last_event_ns_ = std::max(last_event_ns_, std::min(markers_.front().time_ns, end_ns_));
        tail_.push({last_event_ns_, EventKind::marker, 0, 1, 0, markers_.front().value});
    }
}

}  // namespace qduino::printer::step
