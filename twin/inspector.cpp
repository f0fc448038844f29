#include "twin/inspector.h"

#include <algorithm>
#include <cmath>

namespace qduino::twin {

// ---- input from the pins ------------------------------------------------------------------------

void Inspector::on_step(const StepSeen& step) {
    const std::size_t axis = step.axis;
    const std::uint8_t moved = cursor_.pieces().space().gantry().slides_of(axis);
    homing_.settle(step.at, moved);
    if (homing_.was_excursion(moved)) {
        excursions_.leave();
        rest();  // it may be back already
    }
    probing_.rest_until(step.at);
    if (motors_.rest_until(step.at)) rest();
    excursions_.count_step(axis);
    motors_.position[axis] = step.position;
    motors_.now = step.at;
    Comparison& so_far = cursor_.so_far();
    AxisFindings& found = so_far.findings.axes[axis];
    ++found.steps;
    if (excursions_.away()) {
        ++found.unexplained;
        return;
    }
    if ((homing_.pending() & moved) != 0 || (probing_.active() && moved != 0)) return;
    so_far.built[axis] += step.direction;
    const MotorStep asks = cursor_.step_of(axis, step.direction);
    const bool shaped = cursor_.allowance().shaped();
    if (axis == kExtruder) {
        so_far.pushed_steps += step.direction > 0 ? 1 : 0;
        so_far.net_steps += step.direction;
        watch_advance(step.direction);
        shaped ? shaped_.follow_extruder(asks) : straight_.follow_extruder(asks);
    } else if (shaped ? shaped_.follow(asks) : straight_.follow(asks)) {
        excursions_.goes_on();
    }
    if (!homing_.active() && excursions_.leaves(axis)) excursions_.leave();
}

void Inspector::on_endstop(Instant at, int axis, bool pressed) {
    motors_.now = at;
    motors_.pressed[axis] = pressed;
    homing_.on_endstop(at, axis, pressed);
}

void Inspector::on_probe(Instant at) {
    motors_.now = std::max(motors_.now, at);
    probing_.on_touch();
}

void Inspector::on_typed(std::uint64_t behind_line, std::string_view line, double left_mm) {
    const std::optional<AskedPath::Stretch> by = cursor_.pieces().insert(behind_line, line, left_mm);
    if (!by) return;
    cursor_.stretch(*by);
    excursions_.stretch(*by);
}

// Nothing has moved for kRest.
void Inspector::rest() {
    excursions_.begin_count();
    if (homing_.active() || probing_.active()) return;
    if (cursor_.allowance().shaped() && !away()) shaped_.rest();
    excursions_.rest();
}

// At its step the filament stands on the half-step before.
void Inspector::watch_advance(int direction) {
    const AskedPiece& here = cursor_.shown();
    const bool sideways = here.from[0] != here.to[0] || here.from[1] != here.to[1];
    if (direction < 0 || here.kind != AskedItem::Kind::move || !sideways ||
        here.to[kExtruder] <= here.from[kExtruder])
        return advance_.interrupt();
    const double steps_per_mm = cursor_.steps_per_mm(kExtruder);
    const Comparison& so_far = cursor_.so_far();
    advance_.on_push(motors_.now, so_far.at[kExtruder] / steps_per_mm,
                     (so_far.built[kExtruder] - 0.5) / steps_per_mm, here.advance_s,
                     cursor_.pieces().asked().compensation().smooth_s());
}

// ---- the end of a job ---------------------------------------------------------------------------

Findings Inspector::finish(Instant now, bool read_rest) {
    homing_.settle(now, 0);
    probing_.settle(now);
    if (excursions_.differs()) rest();
    const bool busy = homing_.active() || probing_.active();
    if (!busy) excursions_.take_leave();
    AskedPath& asked = cursor_.pieces().asked();
    Findings& all = cursor_.so_far().findings;
    excursions_.sum_up(all);
    all.line = cursor_.pieces().front().line;
    all.path_consumed = !busy && cursor_.pass_rest();
    while (read_rest && asked.next().kind != AskedItem::Kind::end) {
    }
    final_asked_ = asked.position();
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) sum_up(all.axes[axis], axis);
    const double filament_steps_per_mm = cursor_.steps_per_mm(kExtruder);
    const Comparison& so_far = cursor_.so_far();
    all.advance_gain = advance_.gain();
    all.advance_stretches = advance_.stretches();
    all.filament_asked_mm = asked.filament_net_mm();
    all.filament_asked_pushed_mm = asked.filament_pushed_mm();
    all.filament_built_mm = static_cast<double>(so_far.net_steps) / filament_steps_per_mm;
    all.filament_built_pushed_mm = static_cast<double>(so_far.pushed_steps) / filament_steps_per_mm;
    return all;
}

void Inspector::sum_up(AxisFindings& found, std::size_t axis) const {
    const AskedPieces& pieces = cursor_.pieces();
    const MotorSpace& space = pieces.space();
    const Comparison& so_far = cursor_.so_far();
    const MotorPoint asked_steps =
        so_far.findings.path_consumed
            ? pieces.all().back().to
            : space.to_steps(space.corrected(final_asked_, pieces.asked().bed().now()));
    found.reach_mm = space.gantry().reach_of(cursor_.allowance().reach_mm().mm)[axis];
    found.turn_mm = cursor_.allowance().turn_mm()[axis];
    found.path_deviation_mm_max = so_far.worst[axis] / space.steps_per_mm(axis);
    found.curve_deviation_mm_max = so_far.worst_curved[axis] / space.steps_per_mm(axis);
    found.final_asked_mm = final_asked_[axis];
    found.final_built_mm = space.to_mm(motors_.place())[axis];
    // Two belts that were homed along one axis may both be half a step off.
    const bool belt = space.gantry().slides_of(axis) == 0b011;
    found.final_exact =
        std::abs(motors_.steps(axis) - asked_steps[axis]) <= (belt ? 1.0 : 0.5) + PathCursor::kTieSteps;
}

InspectionStart Inspector::next_start() const {
    const AskedPieces& pieces = cursor_.pieces();
    const Gantry& gantry = pieces.space().gantry();
    InspectionStart start;
    start.built = motors_.position;
    start.origin = motors_.origin;
    start.pressed = motors_.pressed;
    start.bed = pieces.asked().bed().behind(pieces.space().machine());
    start.maps = pieces.space().maps();
    const Position built = pieces.space().to_mm(motors_.place());
    const Findings& found = cursor_.so_far().findings;
    const auto exact = [&](std::size_t motor) { return found.axes[motor].final_exact; };
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
        // A job that was cut short leaves the firmware on whole steps: the fraction that was asked
        // last is gone.
        bool as_asked = found.path_consumed && exact(axis);
        for (std::size_t motor = 0; motor < kSlideCount && axis < kSlideCount; ++motor)
            as_asked = as_asked && (gantry.slides_of(motor) == 1u << motor || exact(motor));
        start.asked_mm[axis] = as_asked ? final_asked_[axis] : built[axis];
    }
    return start;
}

}  // namespace qduino::twin
