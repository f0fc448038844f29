#include "printer/estimate/estimator.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "printer/machine/probe_run.h"
#include "printer/machine/vectors.h"
#include "printer/step/path_solver.h"

namespace qduino::printer::estimate {
namespace {

/// Loop 2 begins 2 ms after it finds the first step (step/player.h: lead), and tells every 10 ms
/// how far it is (step/stepper_loop.h).
constexpr double kHandOver_s = 0.002 + 0.010 / 2;

/// machine/parking.h: it rests before it leaves.
constexpr double kRestBeforeLeave_s = 0.1;

/// Markers: the machine has one behind each move, which tells how far the job is done.
constexpr std::uint32_t kProgress = 0, kTarget = 1;

double away_from_switch(const AxisConfig& config) { return config.home_towards_minimum ? 1 : -1; }

}  // namespace

std::string_view name_of(Activity activity) {
    constexpr std::array<std::string_view, kActivityCount> kNames{
        "unknown",      "outer_wall",        "inner_wall",  "overhang", "sparse_infill",
        "solid_infill", "top_surface",       "bridge",      "gap_fill", "skirt",
        "support",      "support_interface", "prime_tower", "ironing",  "custom",
        "travel",       "retraction",        "dwell",       "homing",   "heating"};
    return kNames[static_cast<std::size_t>(activity)];
}

Estimator::Estimator(const MachineConfig& machine)
    : machine_(machine),
      planner_(motion::motion_settings(machine_), machine::to_vector(home_positions(machine_))),
      accelerations_(machine::accelerations_of(machine_)),
      heat_(machine_),
      filters_(times_of(planner_.settings())) {
    for (const Axis axis : gcode::kToolAxes) {
        const AxisConfig& config = machine_.axes[axis];
        expected_mm_[axis] = (expected_place(config) - config.home_position).value();
    }
}

Estimator::FilterTimes Estimator::times_of(const motion::MotionSettings& settings) {
    const auto solver = std::make_unique<step::PathSolver>(settings);
    return {1e-9 * static_cast<double>(solver->future_ns()), 1e-9 * static_cast<double>(solver->past_ns())};
}

// ---- what the job does --------------------------------------------------------------------------

void Estimator::on_move(const gcode::Move& move, const preflight::MoveContext& context) {
    make_room();
    layer_ = context.layer.index;
    end_offset_ = move.source.end_offset;
    printed_.include(move);
    const std::size_t before = planner_.size();
    const bool fits = planner_.append({{move.to[0].value(), move.to[1].value(), move.to[2].value()},
                                       (move.to[Axis::e] - move.from[Axis::e]).value(),
                                       move.feedrate.value(),
                                       accelerations_.of(move.kind)});
    QDUINO_EXPECT(fits);
    const Activity activity = context.extrudes                         ? activity_of(context.feature)
                              : move.kind == gcode::MoveKind::filament ? Activity::retraction
                                                                       : Activity::travel;
    // A move that is too short is left to the next one.
    if (planner_.size() > before) remember({activity, {}, layer_, {}, end_offset_});
    append_marker(kProgress, activity);
}

void Estimator::on_dwell(Seconds duration) {
    make_room();
    const bool fits = planner_.append_dwell(duration.value());
    QDUINO_EXPECT(fits);
    remember({Activity::dwell, {}, layer_, {}, end_offset_});
}

void Estimator::append_marker(std::uint32_t value, Activity activity, gcode::Heater heater, Celsius target) {
    const bool fits = planner_.append_marker(value);
    QDUINO_EXPECT(fits);
    remember({activity, heater, layer_, target, end_offset_});
}

void Estimator::on_limits(const gcode::LimitChange& change) {
    motion::MotionSettings settings = planner_.settings();
    machine::apply(change, settings, accelerations_);
    planner_.set_settings(settings);
}

void Estimator::on_temperature(gcode::Heater heater, Celsius target, std::optional<gcode::WaitFor> wait) {
    make_room();
    append_marker(kTarget, Activity::heating, heater, target);
    if (!wait) return;
    come_to_rest();
    wait_for_release(Activity::heating);
    heat_.pass(cooling_s_);
    cooling_s_ = 0;
    const double waited_s = heat_.wait(heater, target, *wait);
    estimate_.total_s += waited_s;
    estimate_.activity_s[static_cast<std::size_t>(Activity::heating)] += waited_s;
    estimate_.heated_byte = end_offset_;
}

void Estimator::on_motors_off(gcode::AxisSet unhomed) {
    for (const Axis axis : gcode::kToolAxes) let_go_[axis] = let_go_[axis] || unhomed.contains(axis);
    come_to_rest();
    wait_for_release(Activity::dwell);
}

/// As machine/parking.cpp takes the head up and beside the part, where the job does not.
void Estimator::take_leave() {
    motion::AxisVector at = planner_.position_mm();
    const auto is_homed = [this](Axis axis) { return !expected_mm_[axis] && !let_go_[axis]; };
    const bool leaves = machine_.park.enabled && printed_.reaches(at[2]) &&
                        std::ranges::all_of(gcode::kToolAxes, is_homed) &&
                        machine_.kinematics.type != KinematicsType::delta;
    if (!leaves) return;
    const auto inside = [&](double mm, Axis axis) {
        return std::clamp(mm, machine_.axes[axis].minimum.value(), machine_.axes[axis].maximum.value());
    };
    const double up_mm = std::max(at[2] + machine_.park.z_hop.value(), printed_.clear_mm(at[2]));
    at[2] = std::max(at[2], inside(up_mm, Axis::z));
    bool fits = planner_.append_to(at, machine_.axes[Axis::z].max_speed.value(), accelerations_.travel);
    at[0] = inside(machine_.park.x.value(), Axis::x);
    at[1] = inside(machine_.park.y.value(), Axis::y);
    fits = planner_.append_to(at, machine_.park.speed.value(), accelerations_.travel) && fits;
    QDUINO_EXPECT(fits);
    planner_.flush();
    for (motion::Segment segment; planner_.next(segment);)
        spend(Activity::travel, segment.shape.duration_s());
    spend(Activity::dwell, filters_.before_s + filters_.behind_s + kRestBeforeLeave_s);
}

void Estimator::on_end(std::uint64_t) {
    come_to_rest();
    take_leave();
    // A job that waited for its last action ends in the release that saw it done.
    if (estimate_.total_s != released_s_) wait_for_release(Activity::dwell);
}

// ---- homing -------------------------------------------------------------------------------------

double Estimator::from_switch_mm(Axis axis) const {
    const AxisConfig& config = machine_.axes[axis];
    const double place_mm = planner_.position_mm()[axis] + expected_mm_[axis].value_or(0);
    return std::max(0.0, away_from_switch(config) * (place_mm - config.home_position.value()));
}

/// `from_switch_mm`: where an approach begins.
double Estimator::duration_of(const machine::Homing::Order& order, double from_switch_mm) {
    if (order.phase == machine::Homing::Phase::settle) return machine::kHomingRest_s;
    const motion::AxisVector begin = planner_.position_mm();
    motion::AxisVector end = begin;
    end[order.axis] += order.distance_mm;
    const bool fits = planner_.append_to(end, order.speed_mm_s, accelerations_.travel);
    planner_.flush();
    motion::Segment segment;
    const bool moves = planner_.next(segment);
    QDUINO_EXPECT(fits && moves);
    planner_.reset(begin);
    const double whole_mm = std::abs(order.distance_mm);
    return segment.shape.time_at(order.approaches() ? std::min(from_switch_mm, whole_mm) : whole_mm);
}

void Estimator::on_home(gcode::AxisSet axes) {
    come_to_rest();
    wait_for_release(Activity::homing);
    machine::Homing homing{machine_};
    double left_mm = 0;
    for (homing.begin(axes); homing.active();) {
        const machine::Homing::Order order = homing.order();
        const bool searches = order.phase == machine::Homing::Phase::fast_approach;
        if (searches) left_mm = from_switch_mm(order.axis);
        const double duration_s = duration_of(order, left_mm);
        if (searches && expected_mm_[order.axis]) {
            estimate_.less_s += duration_s - duration_of(order, 0);
            estimate_.more_s += duration_of(order, std::abs(order.distance_mm)) - duration_s;
        }
        spend(Activity::homing, duration_s);
        // What is left at the switch is dropped: there filters do not run out.
        if (order.phase != machine::Homing::Phase::settle) spend(Activity::homing, filters_.before_s);
        if (order.phase == machine::Homing::Phase::retreat) spend(Activity::homing, filters_.behind_s);
        // It is over when loop 1 sees it, and the next order begins one release later.
        wait_for_release(Activity::homing);
        left_mm = order.approaches() ? 0 : std::abs(order.distance_mm);
        if (order.phase == machine::Homing::Phase::settle) {
            motion::AxisVector home = planner_.position_mm();
            for (const Axis axis : gcode::kToolAxes) {
                if (!order.switches.contains(axis)) continue;
                home[axis] = machine_.axes[axis].home_position.value();
                expected_mm_[axis].reset();
                let_go_[axis] = false;
            }
            planner_.reset(home);
        }
        const bool goes_on = homing.done(true);
        QDUINO_EXPECT(goes_on);
        if (homing.active()) wait_for_release(Activity::homing);
    }
}

// ---- probing ------------------------------------------------------------------------------------

/// Up to the clearance and over `place` (machine/probe_run.h): seconds.
double Estimator::way_of_probe(const ProbePlace& place) {
    motion::AxisVector at = planner_.position_mm();
    at[2] = machine_.mesh.clearance.value();
    const double lift_mm_s = machine_.axes[Axis::z].max_speed.value();
    const bool lifts = planner_.append_to(at, lift_mm_s, accelerations_.travel);
    at[0] = place.x.value();
    at[1] = place.y.value();
    const bool goes = planner_.append_to(at, machine_.mesh.travel_speed.value(), accelerations_.travel);
    QDUINO_EXPECT(lifts && goes);
    planner_.flush();
    double way_s = 0;
    for (motion::Segment segment; planner_.next(segment);) way_s += segment.shape.duration_s();
    return way_s;
}

/// Down to a bed that is plane: seconds.
double Estimator::way_to_bed() {
    motion::AxisVector bed = planner_.position_mm();
    const double height_mm = bed[2] - machine_.probe.trigger_height.value();
    motion::AxisVector end = bed;
    end[2] = machine_.probe.trigger_height.value() - machine::ProbeRun::kTooLow_mm;
    const bool fits = planner_.append_to(end, machine_.probe.speed.value(), accelerations_.travel);
    planner_.flush();
    motion::Segment segment;
    const bool moves = planner_.next(segment);
    QDUINO_EXPECT(fits && moves);
    bed[2] = machine_.probe.trigger_height.value();
    planner_.reset(bed);
    return segment.shape.time_at(std::clamp(height_mm, 0.0, segment.shape.length_mm));
}

/// As machine/probe_run.h goes from point to point; each order begins a release after the one
/// before it.
void Estimator::on_probe() {
    come_to_rest();
    wait_for_release(Activity::homing);
    const std::size_t points = probe_count(machine_.mesh);
    for (std::size_t point = 0; point < points; ++point) {
        spend(Activity::homing, filters_.before_s + way_of_probe(probe_place(machine_, point)));
        spend(Activity::homing, filters_.behind_s);
        for (int releases = 0; releases < 2; ++releases) wait_for_release(Activity::homing);
        spend(Activity::homing, filters_.before_s + way_to_bed());  // what is left is dropped
        for (int releases = 0; releases < 2; ++releases) wait_for_release(Activity::homing);
    }
    const double up_s = way_of_probe(probe_place(machine_, points - 1));
    spend(Activity::homing, filters_.before_s + up_s);
    spend(Activity::homing, std::max(machine::ProbeRun::kRest_s, filters_.behind_s));
    wait_for_release(Activity::homing);
}

// ---- time ---------------------------------------------------------------------------------------

void Estimator::take_final() {
    motion::Segment segment;
    while (planner_.next(segment, machine::MotionPipe::kPlannerReserve)) take(segment);
}

void Estimator::come_to_rest() {
    planner_.flush();
    take_final();
    if (moving_) spend(Activity::dwell, filters_.behind_s);
    moving_ = false;
}

void Estimator::take(const motion::Segment& segment) {
    const Purpose& purpose = purposes_[taken_++ % purposes_.size()];
    if (segment.kind == motion::SegmentKind::marker) {
        if (segment.value == kProgress) return;
        heat_.pass(cooling_s_);
        cooling_s_ = 0;
        heat_.set_target(purpose.heater, purpose.target);
        return;
    }
    const bool moves = segment.kind == motion::SegmentKind::move;
    double duration_s = moves
                            ? segment.shape.duration_s()
                            : 1e-9 * static_cast<double>(segment.end.ns_after(0) - segment.start.ns_after(0));
    // Filters run out in a dwell. A motion that begins before its plan begins later for that.
    if (moves && !moving_) duration_s += filters_.before_s;
    if (!moves && moving_) duration_s = std::max(duration_s, filters_.behind_s);
    moving_ = moves;
    spend(purpose.activity, duration_s);
    estimate_.profile.add(estimate_.total_s - estimate_.heating_s(), purpose.end_offset);
    if (estimate_.layer_s.size() <= purpose.layer) estimate_.layer_s.resize(purpose.layer + 1);
    estimate_.layer_s[purpose.layer] += static_cast<float>(duration_s);
}

void Estimator::spend(Activity activity, double duration_s) {
    estimate_.total_s += duration_s;
    estimate_.activity_s[static_cast<std::size_t>(activity)] += duration_s;
    cooling_s_ += duration_s;
}

/// On to the release in which loop 1 sees that everything has been played.
void Estimator::wait_for_release(Activity activity) {
    constexpr double kPeriod_s = HeatForecast::kRelease_s;
    const double seen_s = estimate_.total_s + kHandOver_s;
    const double next_s = (std::floor(seen_s / kPeriod_s + 1e-6) + 1) * kPeriod_s;
    spend(activity, next_s - estimate_.total_s);
    released_s_ = estimate_.total_s;
}

}  // namespace qduino::printer::estimate
