#include "printer/motion/planner.h"

#include <algorithm>
#include <cmath>

#include "base/contract.h"
#include "printer/motion/s_curve.h"

namespace qduino::printer::motion {

Planner::Planner(const MotionSettings& settings, const AxisVector& position_mm)
    : settings_(settings), position_mm_(position_mm) {}

// ---- in -----------------------------------------------------------------------------------------

MoveGeometry Planner::geometry_of(const AxisVector& end_mm, double length_mm, double speed_mm_s,
                                  double acceleration_mm_s2) const {
    MoveGeometry geometry;
    geometry.length_mm = length_mm;
    geometry.speed_mm_s = std::max(speed_mm_s, kSpeedMin_mm_s);
    geometry.acceleration_mm_s2 = acceleration_mm_s2;
    geometry.deviation_mm = junction_deviation_mm(settings_.square_corner_speed.value(), acceleration_mm_s2);
    const double step_interval_s = to_seconds(settings_.step_interval_min);
    const AxisVector rates = settings_.kinematics.rates(position_mm_, end_mm, length_mm);
    for (std::size_t i = 0; i < kAxisCount; ++i) {
        geometry.direction[i] = (end_mm[i] - position_mm_[i]) / length_mm;
        // The axis, and the motor of its number.
        const double share = std::max(std::abs(geometry.direction[i]), rates[i]);
        if (share == 0) continue;
        const double axis_speed = settings_.max_speed[i].value();
        geometry.speed_mm_s = std::min(geometry.speed_mm_s, axis_speed / share);
        geometry.acceleration_mm_s2 =
            std::min(geometry.acceleration_mm_s2, settings_.max_acceleration[i].value() / share);
        if (rates[i] == 0) continue;
        const double step_rate_speed = 1 / (step_interval_s * settings_.steps_per_mm[i]);
        geometry.speed_mm_s = std::min(geometry.speed_mm_s, step_rate_speed / rates[i]);
    }
    return geometry;
}

AxisVector Planner::end_of(const Move& move) const {
    return {move.end_mm[0], move.end_mm[1], move.end_mm[2], position_mm_[3] + move.filament_mm};
}

Planner::Way Planner::way_of(const AxisVector& delta_mm) {
    const double space_mm =
        std::sqrt(delta_mm[0] * delta_mm[0] + delta_mm[1] * delta_mm[1] + delta_mm[2] * delta_mm[2]);
    const bool extrude_only = space_mm < kLengthMin_mm;
    return {extrude_only ? std::abs(delta_mm[3]) : space_mm, extrude_only};
}

double Planner::nominal_s(const Move& move) const {
    const AxisVector end_mm = end_of(move);
    AxisVector delta_mm{};
    for (std::size_t i = 0; i < kAxisCount; ++i) delta_mm[i] = end_mm[i] - position_mm_[i];
    const double length_mm = way_of(delta_mm).length_mm;
    if (length_mm < kLengthMin_mm) return 0;
    return length_mm / geometry_of(end_mm, length_mm, move.speed_mm_s, move.acceleration_mm_s2).speed_mm_s;
}

bool Planner::append(const Move& move) {
    return append_to(end_of(move), move.speed_mm_s, move.acceleration_mm_s2);
}

bool Planner::append_to(const AxisVector& end_mm, double speed_mm_s, double acceleration_mm_s2) {
    QDUINO_EXPECT(std::isfinite(speed_mm_s) && acceleration_mm_s2 > 0);
    QDUINO_EXPECT(std::isfinite(end_mm[0] + end_mm[1] + end_mm[2] + end_mm[3]));
    if (full()) return false;
    AxisVector delta_mm{};
    for (std::size_t i = 0; i < kAxisCount; ++i) delta_mm[i] = end_mm[i] - position_mm_[i];
    const auto [length_mm, extrude_only] = way_of(delta_mm);
    if (length_mm < kLengthMin_mm) return true;

    MoveGeometry geometry = geometry_of(end_mm, length_mm, speed_mm_s, acceleration_mm_s2);
    geometry.extrude_only = extrude_only;
    const double limit2 =
        end_at_rest_ ? 0 : junction_speed_squared(last_move_, geometry, settings_.instantaneous_speed);
    Entry& added = push(SegmentKind::move, {.limit2 = limit2,
                                            .gain2 = 2 * geometry.acceleration_mm_s2 * length_mm,
                                            .acceleration_mm_s2 = geometry.acceleration_mm_s2,
                                            .jerk_mm_s3 = settings_.jerk_mm_s3});
    added.segment.end_mm = end_mm;
    // Filament that is pushed along a way; neither a retraction nor a travel move presses.
    if (delta_mm[3] > 0 && (delta_mm[0] != 0 || delta_mm[1] != 0))
        added.segment.advance_s = settings_.pressure_advance.value();
    added.geometry = geometry;
    appended_s_ += length_mm / geometry.speed_mm_s;
    position_mm_ = end_mm;
    last_move_ = geometry;
    end_at_rest_ = false;
    return true;
}

Planner::Entry& Planner::push(SegmentKind kind, const Node& planned) {
    node(tail_) = planned;
    Entry& added = entry(tail_);
    added = Entry{};
    added.segment.kind = kind;
    added.segment.start_mm = added.segment.end_mm = position_mm_;
    ++tail_;
    dirty_ = true;
    return added;
}

bool Planner::push_standstill(SegmentKind kind, Axis axis, std::uint32_t value, double dwell_s) {
    if (full()) return false;
    Entry& added = push(kind, {});
    added.segment.axis = axis;
    added.segment.value = value;
    added.dwell_s = dwell_s;
    end_at_rest_ = true;
    return true;
}

bool Planner::append_dwell(double duration_s) {
    QDUINO_EXPECT(duration_s >= 0 && std::isfinite(duration_s));
    return push_standstill(SegmentKind::dwell, Axis::x, 0, duration_s);
}

bool Planner::append_homing(Axis axis, MotorMask motors) {
    return push_standstill(SegmentKind::homing, axis, motors, 0);
}

bool Planner::append_filters(const MotionFilters& filters) {
    if (!push_standstill(SegmentKind::filters, Axis::x, 0, 0)) return false;
    entry(tail_ - 1).segment.filters = filters;
    return true;
}

bool Planner::append_marker(std::uint32_t value) {
    if (full()) return false;
    const double nominal2 = last_move_.speed_mm_s * last_move_.speed_mm_s;
    Entry& added = push(SegmentKind::marker, {.limit2 = end_at_rest_ ? 0 : nominal2});
    added.segment.value = value;
    return true;
}

// ---- planning -----------------------------------------------------------------------------------

double Planner::reach2(const Node& node, double speed2) {
    if (node.jerk_mm_s3 <= 0 || node.gain2 <= 0) return speed2 + node.gain2;
    const double length_mm = node.gain2 / (2 * node.acceleration_mm_s2);
    const double reached =
        speed_after_ramp(std::sqrt(speed2), length_mm, node.acceleration_mm_s2, node.jerk_mm_s3);
    return reached * reached;
}

void Planner::plan() {
    const std::uint64_t end = plan_end();
    plan_backward(end);
    plan_forward(end);
    dirty_ = false;
}

void Planner::plan_backward(std::uint64_t end) {
    const bool must_stop = held_ || end_at_rest_;
    double safe2 = 0;
    double hopeful2 = must_stop ? 0 : last_move_.speed_mm_s * last_move_.speed_mm_s;
    for (std::uint64_t i = end; i-- > head_;) {
        Node& here = node(i);
        safe2 = here.safe2 = std::min(here.limit2, reach2(here, safe2));
        hopeful2 = here.hopeful2 = std::min(here.limit2, reach2(here, hopeful2));
    }
}

void Planner::plan_forward(std::uint64_t end) {
    const bool must_stop = held_ || end_at_rest_;
    const double last2 = must_stop ? 0 : last_move_.speed_mm_s * last_move_.speed_mm_s;
    double safe2 = entry2_;
    double hopeful2 = entry2_;
    ready_ = head_;
    for (std::uint64_t i = head_; i < end; ++i) {
        const bool is_last = i + 1 == end;
        safe2 = std::min(is_last ? 0 : node(i + 1).safe2, reach2(node(i), safe2));
        hopeful2 = std::min(is_last ? last2 : node(i + 1).hopeful2, reach2(node(i), hopeful2));
        node(i).exit2 = safe2;
        if (ready_ == i && safe2 == hopeful2) ready_ = i + 1;
    }
}

// ---- out ----------------------------------------------------------------------------------------

bool Planner::next(Segment& out, std::size_t room) {
    if (head_ == plan_end()) return false;
    if (head_ >= ready_ && dirty_) plan();
    if (head_ >= ready_ && free() >= room) return false;
    release(out);
    return true;
}

void Planner::release(Segment& out) {
    const Entry& oldest = entry(head_);
    const double exit2 = node(head_).exit2;
    out = oldest.segment;
    out.start = clock_;
    if (out.kind == SegmentKind::move) {
        const double exit_speed = std::sqrt(exit2);
        const MoveGeometry& move = oldest.geometry;
        const double jerk = node(head_).jerk_mm_s3;
        out.shape = jerk > 0 ? make_s_curve(move.length_mm, entry_speed_mm_s_, move.speed_mm_s, exit_speed,
                                            move.acceleration_mm_s2, jerk)
                             : make_trapezoid(move.length_mm, entry_speed_mm_s_, move.speed_mm_s, exit_speed,
                                              move.acceleration_mm_s2);
        clock_.advance_s(out.shape.duration_s());
        entry_speed_mm_s_ = exit_speed;
        entry2_ = exit2;
    } else {
        out.shape.entry_speed_mm_s = out.shape.exit_speed_mm_s = entry_speed_mm_s_;
        clock_.advance_s(oldest.dwell_s);
    }
    out.end = clock_;
    ++head_;
}

// ---- pause and cancel ---------------------------------------------------------------------------

void Planner::hold() {
    if (held_) return;
    hold_ = earliest_stop();
    held_ = true;
    dirty_ = true;
    ready_ = head_;
}

/// The first node at which the speed at the head can be brought to rest. Bounds on the way need no
/// check: the speed at the head was planned below them. Markers at the stop are still reported:
/// their moves are done.
std::uint64_t Planner::earliest_stop() {
    for (std::uint64_t stop = head_; stop < tail_; ++stop) {
        if (entry(stop).segment.kind == SegmentKind::marker) continue;
        double reachable2 = 0;
        for (std::uint64_t i = stop; i-- > head_ && reachable2 < entry2_;)
            reachable2 = reach2(node(i), reachable2);
        if (reachable2 >= entry2_) return stop;
    }
    return tail_;
}

const AxisVector& Planner::held_position_mm() const {
    QDUINO_EXPECT(held_);
    return hold_ == tail_ ? position_mm_ : entries_[hold_ % kCapacity].segment.start_mm;
}

void Planner::wait_until(const TimelineInstant& at) {
    QDUINO_EXPECT(stopped() && at.ns_after(0) >= clock_.ns_after(0));
    clock_ = at;
}

void Planner::resume() {
    if (!held_) return;
    held_ = false;
    dirty_ = true;
    if (hold_ != tail_) node(hold_).limit2 = 0;
    if (hold_ == tail_) end_at_rest_ = true;
}

void Planner::discard_held() {
    QDUINO_EXPECT(held_);
    if (hold_ != tail_) position_mm_ = entry(hold_).segment.start_mm;
    tail_ = hold_;
    held_ = false;
    end_at_rest_ = true;
    dirty_ = true;
}

void Planner::reset(const AxisVector& position_mm, const TimelineInstant& at) {
    clock_ = at;
    head_ = ready_ = tail_;
    held_ = false;
    dirty_ = false;
    end_at_rest_ = true;
    entry_speed_mm_s_ = 0;
    entry2_ = 0;
    position_mm_ = position_mm;
}

}  // namespace qduino::printer::motion
