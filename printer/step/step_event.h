// One step of one motor, uncompressed: when, which motor, which way. The solver (loop 1) sends
// these to the player (loop 2), through a ring buffer, in order of time.
#pragma once

#include <cstdint>
#include <type_traits>

#include "base/time.h"
#include "printer/machine_config.h"

namespace qduino::printer::step {

enum class EventKind : std::uint8_t {
    step,  ///< a rising edge on the STEP pin of motor `axis` at `time`
    /// Nothing moves; when the player passes it, `value` is published as the last marker reached.
    marker,
    /// From here on the switch of `axis` ends the steps of the motors in `value`, a mask. 0:
    /// none's.
    homing,
    rest,  ///< the motion stands still here: a ring that runs dry behind it is not starved
};

struct StepEvent {
    std::int64_t time_ns = 0;  ///< on the print's own time line; the player adds its shift
    EventKind kind = EventKind::step;
    std::uint8_t axis = 0;      ///< printer::Axis: of a motor, or of a switch
    std::int8_t direction = 1;  ///< +1 or −1 in the motor's coordinates
    std::uint8_t reserved = 0;
    std::uint32_t value = 0;  ///< marker number, or motors to be ended
};
static_assert(sizeof(StepEvent) == 16 && std::is_trivially_copyable_v<StepEvent>);

/// E has no endstop: the switch in its place is the probe.
inline constexpr Axis kProbeSwitch = Axis::e;

/// 256 Ki events, 4 MB: 2.6 s at 100 000 steps/s.
inline constexpr std::size_t kStepRingCapacity = std::size_t{1} << 18;

}  // namespace qduino::printer::step
