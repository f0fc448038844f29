// One step of one motor, uncompressed: when, which axis, which way. The solver (loop 1) sends these
// to the player (loop 2), through a ring buffer, in order of time.
#pragma once

#include <cstdint>
#include <type_traits>

#include "base/time.h"

namespace qduino::printer::step {

enum class EventKind : std::uint8_t {
    step,  ///< a rising edge on the axis' STEP pin at `time`
    /// Nothing moves; when the player passes it, `value` is published as the last marker reached.
    marker,
    homing,  ///< from here on, steps of `axis` end when its endstop is pressed (value: 1 on, 0 off)
    rest,    ///< the motion stands still here: a ring that runs dry behind it is not starved
};

struct StepEvent {
    std::int64_t time_ns = 0;  ///< on the print's own time line; the player adds its shift
    EventKind kind = EventKind::step;
    std::uint8_t axis = 0;      ///< printer::Axis
    std::int8_t direction = 1;  ///< +1 or −1 in machine coordinates
    std::uint8_t reserved = 0;
    std::uint32_t value = 0;  ///< marker number, or homing switch
};
static_assert(sizeof(StepEvent) == 16 && std::is_trivially_copyable_v<StepEvent>);

/// 256 Ki events, 4 MB: 2.6 s at 100 000 steps/s.
inline constexpr std::size_t kStepRingCapacity = std::size_t{1} << 18;

}  // namespace qduino::printer::step
