#include "twin/probing.h"

namespace qduino::twin {

bool Probing::begins(const PathPlace& place, const MotorStep& step) {
    if (cursor_.pieces().space().gantry().slides_of(step.axis) == 0) return false;
    cursor_.so_far().built[step.axis] -= step.direction;
    cursor_.wait_at_end(place);
    excursions_.forget_but(0);
    active_ = true;
    touches_ = false;
    cursor_.pieces().space().begin_map(++map_);
    return true;
}

void Probing::rest_until(Instant at) {
    if (!active_ || !motors_.rest_until(at)) return;
    if (touches_) {
        MotorSpace& space = cursor_.pieces().space();
        const Position nozzle = space.to_mm(motors_.place());
        const ProbeSpec& probe = space.machine().probe;
        space.map(map_).touch(nozzle[0] + probe.x_offset_mm, nozzle[1] + probe.y_offset_mm,
                              nozzle[2] - probe.trigger_height_mm);
        touches_ = false;
    }
    settle(at);
}

void Probing::settle(Instant at) {
    if (!active_ || !motors_.rest_until(at) || !cursor_.pieces().space().map(map_).complete()) return;
    Comparison& so_far = cursor_.so_far();
    for (std::size_t axis = 0; axis < kSlideCount; ++axis)
        if (std::abs(motors_.steps(axis) - so_far.at[axis]) > 0.5 + PathCursor::kTieSteps) return;
    active_ = false;
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) so_far.built[axis] = motors_.steps(axis);
}

}  // namespace qduino::twin
