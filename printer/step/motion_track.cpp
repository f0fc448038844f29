#include "printer/step/motion_track.h"

#include "printer/motion/s_curve.h"

namespace qduino::printer::step {

void MotionTrack::append(const motion::Segment& segment, double start_s) {
    const motion::Trapezoid& shape = segment.shape;
    const double duration_s = shape.duration_s();
    if (duration_s < kShort_s && size() > kCapacity / 2) {
        if (!joined_.active) joined_ = {start_s, segment.advance_s, true};
        end_s_ = start_s + duration_s;
        end_mm_ = segment.end_mm;
        if (end_s_ - joined_.start_s >= kJoined_s) end_joined();
        return;
    }
    end_joined();
    MotionPiece piece;
    piece.start_s = start_s;
    piece.advance_s = segment.advance_s;
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
        piece.way[axis] = (segment.end_mm[axis] - segment.start_mm[axis]) / shape.length_mm;
    piece.at_mm = segment.start_mm;
    push_ramp(shape, piece, shape.entry_speed_mm_s, shape.cruise_speed_mm_s, shape.accelerate_s);
    push_phase(piece, shape.cruise_s, {shape.cruise_speed_mm_s, 0, 0});
    push_ramp(shape, piece, shape.cruise_speed_mm_s, shape.exit_speed_mm_s, shape.decelerate_s);
    end_s_ = pushed_s_ = piece.start_s;
    end_mm_ = pushed_mm_ = segment.end_mm;
}

/// Pushes `piece` with this distance, and moves it on to where the phase ends.
void MotionTrack::push_phase(MotionPiece& piece, double duration_s, const std::array<double, 3>& path) {
    if (duration_s <= 0) return;
    piece.path = path;
    push(piece);
    const double mm = duration_s * (path[0] + duration_s * (path[1] + duration_s * path[2]));
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) piece.at_mm[axis] += piece.way[axis] * mm;
    piece.start_s += duration_s;
}

void MotionTrack::push_ramp(const motion::Trapezoid& shape, MotionPiece& piece, double from_mm_s,
                            double to_mm_s, double duration_s) {
    const double sign = to_mm_s < from_mm_s ? -1 : 1;
    if (shape.jerk_mm_s3 <= 0)
        return push_phase(piece, duration_s, {from_mm_s, 0.5 * sign * shape.acceleration_mm_s2, 0});
    const motion::SpeedRamp ramp =
        motion::speed_ramp(std::abs(to_mm_s - from_mm_s), shape.acceleration_mm_s2, shape.jerk_mm_s3);
    const double jerk = sign * shape.jerk_mm_s3;
    const double full = jerk * ramp.jerk_s;  // the acceleration in between
    const double first = from_mm_s + 0.5 * full * ramp.jerk_s;
    const double second = first + full * ramp.flat_s;
    push_phase(piece, ramp.jerk_s, {from_mm_s, 0, jerk / 6});
    push_phase(piece, ramp.flat_s, {first, full / 2, 0});
    push_phase(piece, ramp.jerk_s, {second, full / 2, -jerk / 6});
}

void MotionTrack::rest(double duration_s) {
    end_joined();
    MotionPiece piece;
    piece.start_s = end_s_;
    piece.at_mm = end_mm_;
    push(piece);
    pushed_s_ = end_s_ += duration_s;
    pushed_mm_ = end_mm_;
}

/// What was joined so far becomes a piece of a constant speed.
void MotionTrack::end_joined() {
    if (!joined_.active) return;
    joined_.active = false;
    const double duration_s = end_s_ - joined_.start_s;
    if (duration_s <= 0) return;
    MotionPiece piece;
    piece.start_s = joined_.start_s;
    piece.at_mm = pushed_mm_;
    piece.advance_s = joined_.advance_s;
    piece.path = {1, 0, 0};
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
        piece.way[axis] = (end_mm_[axis] - pushed_mm_[axis]) / duration_s;
    push(piece);
    pushed_s_ = end_s_;
    pushed_mm_ = end_mm_;
}

}  // namespace qduino::printer::step
