// The tail end of loop 1: planner → solver → ring, until the ring is full, the budget is spent, or the
// planner wants more.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

#include "printer/motion/planner.h"
#include "printer/step/solver.h"

namespace qduino::printer::step {

/// Moves at most `events_max` events on, and returns how many. `on_segment(const motion::Segment&)` sees each
/// segment as it is taken from the planner. Fewer events than asked for, with room left in the ring: the
/// planner has nothing final; append more, or flush() it. What is kept back for reversals follows once the
/// planner is at rest.
template <class Ring, class OnSegment>
std::size_t feed(motion::Planner& planner, Solver& solver, Ring& ring, std::size_t events_max,
                 OnSegment&& on_segment) {
    std::array<StepEvent, 256> batch;
    std::size_t moved = 0;
    motion::Segment segment;
    while (true) {
        const std::size_t room = std::min({batch.size(), events_max - moved, ring.free()});
        if (room == 0) return moved;
        std::size_t count = 0;
        solver.solve_some(room, [&](const StepEvent& event) { batch[count++] = event; });
        ring.push_some(std::span<const StepEvent>(batch.data(), count));
        moved += count;
        if (count == room || !solver.wants_segment()) continue;
        if (planner.next(segment)) {
            on_segment(segment);
            solver.load(segment);
        } else if (planner.resting() && solver.tail_size() > 0) {
            solver.drain();
        } else {
            return moved;
        }
    }
}

template <class Ring>
std::size_t feed(motion::Planner& planner, Solver& solver, Ring& ring, std::size_t events_max) {
    return feed(planner, solver, ring, events_max, [](const motion::Segment&) {});
}

}  // namespace qduino::printer::step
