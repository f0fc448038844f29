// Receives what happens in the twin: microsteps that really moved something, and switches that
// changed.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/time.h"

namespace qduino::twin {

/// A microstep that the carriage (or the filament) followed. Lost ones are not reported: they built
/// nothing.
struct StepSeen {
    Instant at{};
    std::uint8_t axis = 0;      ///< of the motor (gantry.h)
    std::int8_t direction = 1;  ///< +1 or −1 in the motor's coordinates
    std::int64_t position = 0;  ///< microsteps from the motor's zero, after it
};

/// Called from the thread that drives the twin's pins, in order of time. A step comes before the
/// switch that it presses.
class MotionObserver {
  public:
    virtual ~MotionObserver() = default;
    virtual void on_step(const StepSeen& step) = 0;
    /// Extra motor `which` of the machine stands at `position` now.
    virtual void on_extra_step(std::size_t which, std::int64_t position) {
        static_cast<void>(which), static_cast<void>(position);
    }
    /// The probe has closed.
    virtual void on_probe(Instant at) { static_cast<void>(at); }
    /// The switch of slide `axis` closed or opened (mechanically: without bounce, and whatever
    /// faults its wire has).
    virtual void on_endstop(Instant at, int axis, bool pressed) = 0;
};

}  // namespace qduino::twin
