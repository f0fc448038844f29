#include "printer/machine/parking.h"

#include <algorithm>
#include <cmath>

#include "printer/machine/vectors.h"

namespace qduino::printer::machine {

namespace {

/// Nearer than this to where it must go back to, a detour makes sure that the last move is one.
constexpr double kDetour_mm = 0.1;

bool is_within(double mm, const AxisConfig& axis) {
    return mm >= axis.minimum.value() && mm <= axis.maximum.value();
}

/// `mm`, kept inside; a place that is outside already (an axis that was never homed) is no reason
/// to move there.
double up_to(double from_mm, double mm, const AxisConfig& axis) {
    return std::max(from_mm, std::min(mm, axis.maximum.value()));
}

}  // namespace

void Parking::go(const motion::AxisVector& to, double speed_mm_s, double acceleration_mm_s2) {
    const bool fits = pipe_.planner().append_to(to, speed_mm_s, acceleration_mm_s2);
    QDUINO_EXPECT(fits);  // only a handful of moves is ever on this planner
}

bool Parking::defers_resume() {
    const bool later = phase_ == Phase::leaving || (phase_ == Phase::on_path && heating_.keeps_targets());
    resume_wanted_ = resume_wanted_ || later;
    return later;
}

// ---- away ---------------------------------------------------------------------------------------

bool Parking::leave(const gcode::Interpreter& path, const HomingRun& homing, const PrintedTop& printed) {
    printed_ = printed;
    heating_.keep_targets();
    pipe_.depart();
    left_ = {.steps = pipe_.seen().steps};
    jogs_.reset_modes();
    jogs_.adopt_factors(path.state());
    homing.tell(jogs_);
    phase_ = Phase::leaving;
    left_.filament_mm = pipe_.planner().position_mm()[3];
    const bool parks = config_.park.enabled && homing.all_homed();
    if (parks) plan_way_out();
    return parks || !config_.park.enabled;
}

/// Z above `at`, by the hop, and over what is printed: a delta's carriages may have less room
/// there.
double Parking::lifted(const motion::AxisVector& at) const {
    const double hop = order_.lift.value_or(config_.park.z_hop).value();
    const double z = std::max(at[2] + hop, printed_.clear_mm(at[2]));
    if (kinematics_.is_linear()) return z;
    const Millimetres x = order_.x.value_or(config_.park.x), y = order_.y.value_or(config_.park.y);
    return std::min({z, kinematics_.ceiling(at[0], at[1]), kinematics_.ceiling(x.value(), y.value())});
}

void Parking::plan_way_out() {
    const ParkConfig& park = config_.park;
    const Accelerations& accelerations = pipe_.accelerations();
    motion::AxisVector at = pipe_.planner().position_mm();
    rest();
    // What is drawn back must be pushed again: only if the hot end will be as warm then.
    const bool hot = heating_.may_extrude_now_and_later();
    if (hot) {
        left_.retracted_mm = order_.retract.value_or(park.retract).value();
        at[3] -= left_.retracted_mm;
        go(at, park.retract_speed.value(), accelerations.filament);
    }
    left_.filament_mm = at[3];
    plan_parking(at);
    if (hot && changes_filament()) plan_unloading(at);
    motors_.on_for(pipe_.left_at_mm(), at);
    left_.parked = true;
}

/// Up, and sideways beside the part.
void Parking::plan_parking(motion::AxisVector& at) {
    const ParkConfig& park = config_.park;
    const Accelerations& accelerations = pipe_.accelerations();
    at[2] = up_to(at[2], lifted(at), config_.axes[2]);
    go(at, config_.axes[2].max_speed.value(), accelerations.travel);
    const auto inside = [&](Millimetres place, Axis axis) {
        return std::clamp(place, config_.axes[axis].minimum, config_.axes[axis].maximum).value();
    };
    motion::AxisVector place = at;
    place[0] = inside(order_.x.value_or(park.x), Axis::x);
    place[1] = inside(order_.y.value_or(park.y), Axis::y);
    // High up a delta's carriages have no room for a way sideways: there the part is far below, and
    // the head waits where it is.
    const bool has_room = kinematics_.is_on_bed(place[0], place[1], kDetour_mm) &&
                          kinematics_.carriages_have_room(at, place, 0);
    if (has_room) {
        at = place;
        go(at, park.speed.value(), accelerations.travel);
    }
}

void Parking::take_leave(const PrintedTop& printed) {
    printed_ = printed;
    order_ = {};
    if (pipe_.away()) {
        pipe_.planner().discard_held();
    } else {
        pipe_.depart();
    }
    motion::AxisVector at = pipe_.planner().position_mm();
    const motion::AxisVector from = at;
    rest();
    plan_parking(at);
    motors_.on_for(from, at);
    phase_ = Phase::taking_leave;
}

void Parking::plan_unloading(motion::AxisVector& at) {
    const ParkConfig& park = config_.park;
    const double unload_mm = order_.unload.value_or(park.unload).value();
    left_.load_mm = unload_mm + order_.purge.value_or(park.purge).value();
    at[3] -= unload_mm;
    if (unload_mm > 0) go(at, park.retract_speed.value(), pipe_.accelerations().filament);
}

void Parking::plan_loading(motion::AxisVector& at) {
    at[3] += left_.load_mm;
    go(at, config_.park.purge_speed.value(), pipe_.accelerations().filament);
}

void Parking::stay() {
    phase_ = Phase::parked;
    jogs_.set_position(to_position(pipe_.asked_mm()));
}

Result<Parking::Step> Parking::advance() {
    if (phase_ == Phase::leaving && pipe_.drained()) return Step::arrived;
    if (phase_ == Phase::taking_leave && pipe_.drained()) return Step::left;
    if (phase_ == Phase::heating && pipe_.drained() && heating_.is_warm_again()) {
        phase_ = Phase::returning;
        plan_way_back();
    } else if (phase_ == Phase::returning && pipe_.drained()) {
        return arrive_on_path();
    }
    return Step::goes_on;
}

// ---- back ---------------------------------------------------------------------------------------

void Parking::begin_return() {
    QDUINO_EXPECT(rests());
    resume_wanted_ = at_end_ = false;
    phase_ = Phase::heating;
    heating_.ask_for_kept();
}

/// A move of no length would be none, and might leave a step undone: a little to the side first.
void Parking::plan_detour(motion::AxisVector& at, const motion::AxisVector& to) const {
    for (std::size_t i = 0; i < 3; ++i) {
        if (at[i] == to[i] || std::abs(at[i] - to[i]) >= kDetour_mm) continue;
        at[i] = is_within(to[i] + kDetour_mm, config_.axes[i]) ? to[i] + kDetour_mm : to[i] - kDetour_mm;
    }
    at[2] = std::max(at[2], up_to(to[2], lifted(to), config_.axes[2]));
}

void Parking::plan_way_back() {
    const Accelerations& accelerations = pipe_.accelerations();
    const motion::AxisVector& to = pipe_.left_at_mm();
    motion::AxisVector at = pipe_.planner().position_mm();
    if (left_.load_mm > 0) plan_loading(at);
    const double jogged_mm = at[3] - left_.filament_mm;
    if (at[0] != to[0] || at[1] != to[1] || at[2] != to[2]) {
        plan_detour(at, to);
        const double up_and_down = config_.axes[2].max_speed.value();
        go(at, up_and_down, accelerations.travel);
        at[0] = to[0];
        at[1] = to[1];
        go(at, config_.park.speed.value(), accelerations.travel);
        at[2] = to[2];
        go(at, up_and_down, accelerations.travel);
    }
    if (left_.retracted_mm > 0) {
        at[3] = to[3] + jogged_mm;
        go(at, config_.park.retract_speed.value(), accelerations.filament);
    }
    rest();
}

/// Back, and at rest: the path goes on at the step where it was left.
Result<Parking::Step> Parking::arrive_on_path() {
    const StepCounts& steps = pipe_.seen().steps;
    for (std::size_t i = 0; i < 3; ++i) {
        if (steps[i] == left_.steps[i]) continue;
        return make_error(ErrorCode::faulted, kAxisLetter[i], " came back from the pause ",
                          steps[i] - left_.steps[i], " steps beside where it left: the print is stopped");
    }
    pipe_.scale().skip(Axis::e, steps[3] - left_.steps[3]);
    pipe_.come_back();
    phase_ = Phase::on_path;
    left_ = Left{};
    order_ = {};
    return Step::returned;
}

void Parking::forget() {
    phase_ = Phase::on_path;
    left_ = Left{};
    order_ = {};
    resume_wanted_ = at_end_ = false;
    heating_.forget_kept();
}

}  // namespace qduino::printer::machine
