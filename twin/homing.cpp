#include "twin/homing.h"

#include <cmath>

namespace qduino::twin {

// Does the step bring a slide of its own from its switch, which is open? No homing begins so.
bool Homing::leads_from_open_switch(const MotorStep& step) const {
    const MotorSpace& space = cursor_.pieces().space();
    if (space.gantry().slides_of(step.axis) != 1u << step.axis || motors_.pressed[step.axis]) return false;
    return (step.direction > 0) == space.machine().axes[step.axis].trigger_at_minimum;
}

bool Homing::begins(const PathPlace& place, const MotorStep& step) {
    const Gantry& gantry = cursor_.pieces().space().gantry();
    if ((cursor_.pieces()[place.piece].homed & gantry.slides_of(step.axis)) == 0) return false;
    if (leads_from_open_switch(step)) return false;
    Comparison& so_far = cursor_.so_far();
    so_far.built[step.axis] -= step.direction;  // this step is homing's own
    origin_at_rest_.reset();
    if (excursions_.begins_at_rest(step)) origin_at_rest_ = motors_.origin;
    cursor_.wait_at_end(place);
    // What else was remembered is useless: zero will be elsewhere.
    excursions_.forget_but(origin_at_rest_ ? 1 : 0);
    const std::uint8_t slides = cursor_.pieces().front().homed;
    const std::uint8_t motors = gantry.motors_of(slides);
    for (std::size_t motor = 0; motor < kSlideCount; ++motor)
        if ((motors >> motor & 1u) != 0)
            so_far.built[motor] = so_far.at[motor];  // nothing is compared until it is home
    watch_.begin(motors_.now, slides, motors_.pressed);
    return true;
}

bool Homing::was_excursion(std::uint8_t moved) {
    if (!active() || moved == 0 || (pending() & moved) != 0 || !origin_at_rest_) return false;
    motors_.origin = *origin_at_rest_;
    origin_at_rest_.reset();
    watch_ = HomingWatch{};
    return true;
}

// The slides of `homed` stand at their switches, and the others where they stood.
void Homing::end(std::uint8_t homed) {
    if (homed == 0) return;
    if (!active()) {
        origin_at_rest_.reset();
        excursions_.forget_but(0);
    }
    const MotorSpace& space = cursor_.pieces().space();
    const Gantry& gantry = space.gantry();
    Comparison& so_far = cursor_.so_far();
    Position slides = gantry.is_linear() ? space.to_mm(motors_.place()) : Position{};
    for (std::size_t slide = 0; slide < kSlideCount; ++slide) {
        if ((homed >> slide & 1u) == 0) continue;
        slides[slide] = space.machine().axes[slide].home_mm;
        so_far.findings.axes[slide].homed = true;
        homed_at_[slide] = gantry.slide_steps(slide, motors_.position);
    }
    // A delta's slides are its motors' own.
    const Position motors = gantry.is_linear() ? gantry.motors_at(slides) : slides;
    const std::uint8_t moved = gantry.motors_of(homed);
    for (std::size_t motor = 0; motor < kSlideCount; ++motor) {
        if ((moved >> motor & 1u) == 0) continue;
        so_far.built[motor] = std::floor(motors[motor] * space.steps_per_mm(motor) + 0.5);
        motors_.origin[motor] = static_cast<double>(motors_.position[motor]) - so_far.built[motor];
    }
}

}  // namespace qduino::twin
