#include "printer/step/solver.h"

#include <cmath>

#include "base/contract.h"
#include "printer/motion/kinematics.h"

namespace qduino::printer::step {
namespace {

constexpr std::int64_t kLongAgo = std::numeric_limits<std::int64_t>::min() / 2;

std::int64_t whole_steps(double steps) { return static_cast<std::int64_t>(std::floor(steps + 0.5)); }

}  // namespace

Solver::Solver(const motion::MotionSettings& settings, const motion::AxisVector& position_mm)
    : steps_per_mm_(settings.steps_per_mm), interval_ns_(to_ns(settings.step_interval_min)) {
    reset(position_mm);
}

void Solver::reset(const motion::AxisVector& position_mm) {
    const motion::AxisVector motors_mm = motion::motors_from_tool(position_mm);
    for (std::size_t i = 0; i < kAxisCount; ++i) {
        counts_[i] = whole_steps(motors_mm[i] * steps_per_mm_[i]);
        tracks_[i] = Track{};
    }
    last_ns_.fill(kLongAgo);
    before_last_ns_.fill(kLongAgo);
    next_ns_.fill(kNever);
    end_ns_ = last_event_ns_ = kLongAgo;
    tail_begin_ = tail_end_;
    solving_ = draining_ = ends_at_rest_ = false;
}

void Solver::load(const motion::Segment& segment) {
    QDUINO_EXPECT(wants_segment());
    draining_ = false;
    end_ns_ = std::max(end_ns_, segment.end.ns_after(0));
    switch (segment.kind) {
        case motion::SegmentKind::move:
            load_move(segment);
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
    }
}

void Solver::load_move(const motion::Segment& segment) {
    shape_ = segment.shape;
    start_ = segment.start;
    ends_at_rest_ = segment.shape.exit_speed_mm_s == 0;
    const motion::AxisVector from_mm = motion::motors_from_tool(segment.start_mm);
    const motion::AxisVector to_mm = motion::motors_from_tool(segment.end_mm);
    for (int i = 0; i < kAxisCount; ++i) {
        const double steps_per_mm = steps_per_mm_[i];
        load_track(i, from_mm[i] * steps_per_mm, to_mm[i] * steps_per_mm);
        drop_reversal(i);
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

void Solver::keep_event(EventKind kind, int axis, std::uint32_t value) {
    last_event_ns_ = std::max(last_event_ns_, end_ns_);
    keep({last_event_ns_, kind, static_cast<std::uint8_t>(axis), 1, 0, value});
}

/// If the first step of `axis` in the new segment undoes one that is still kept, nearer than the
/// gap, neither is made. Not across a homing switch: only the player will know which steps before
/// it are really made.
void Solver::drop_reversal(int axis) {
    Track& track = tracks_[axis];
    if (track.total == 0) return;
    std::size_t at = tail_end_;
    while (at != tail_begin_) {
        const StepEvent& kept = tail_[--at % kTailCapacity];
        if (kept.kind == EventKind::homing) return;
        if (kept.kind != EventKind::step || kept.axis != axis) continue;
        const std::int64_t again_ns = start_.ns_after(shape_.time_at(track.first_mm));
        if (kept.direction == track.direction || again_ns - kept.time_ns >= interval_ns_) return;
        for (std::size_t i = at; i + 1 != tail_end_; ++i)
            tail_[i % kTailCapacity] = tail_[(i + 1) % kTailCapacity];
        --tail_end_;
        last_ns_[axis] = before_last_ns_[axis];
        ++pairs_dropped_;
        ++track.done;
        return;
    }
}

}  // namespace qduino::printer::step
