// Faults of the machine as configuration: which part breaks, where, and when.
#pragma once

#include <cstdint>
#include <string_view>

#include "base/result.h"
#include "base/time.h"

namespace qduino::twin {

enum class FaultKind : std::uint8_t {
    sensor_stuck,         ///< a thermistor reads for ever what it read at that instant
    sensor_drifts,        ///< a thermistor reads 0.5 °C less with each second
    sensor_open,          ///< a thermistor's wire is broken
    sensor_short,         ///< a thermistor's wire touches ground
    heater_disconnected,  ///< a heater takes no current
    heater_stuck_on,      ///< a heater's transistor is shorted
    fan_dead,             ///< the part fan does not turn
    bus_silent,           ///< the converter no longer answers
    endstop_stuck_closed,
    endstop_stuck_open,
    motor_disconnected,  ///< a motor's cable is cut: its driver steps, nothing moves
};

struct Fault {
    FaultKind kind = FaultKind::bus_silent;
    std::uint8_t which = 0;  ///< heater number (kHotEnd, kBed) or axis number, as the kind needs
    Instant at{};            ///< from this instant on
};

/// Reads KIND[:WHERE][@SECONDS], e.g. "sensor_stuck:hot_end@120", "endstop_stuck_open:x",
/// "bus_silent@5". WHERE is hot_end or bed for sensors and heaters (default hot_end), x y z e for
/// switches and motors (required). Error: invalid_argument, which names the part that was not
/// understood and lists what is known.
[[nodiscard]] Result<Fault> parse_fault(std::string_view text);

[[nodiscard]] std::string_view name_of(FaultKind kind);

}  // namespace qduino::twin
