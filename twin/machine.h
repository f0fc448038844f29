// The machine that the twin is: its motors, slides, heaters and wiring, as a mechanic would measure
// them.
//
// The twin must not learn what the firmware believes, or it could not disprove it. So it does not
// see the printer's configuration. The defaults are the same reference machine (the paper's
// Printrbot Simple Metal with the heated-bed kit), written down a second time: a wrong steps/mm in
// either shows as a part of the wrong size. That check is lost where an app makes the twin from the
// printer's own machine file (apps/machine_file/twin_machine.h); printer-sim's --twin-machine gives
// the twin a file of its own.
#pragma once

#include <array>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "base/time.h"
#include "device/thermistor.h"

namespace qduino::twin {

enum class Axis : std::uint8_t { x = 0, y = 1, z = 2, e = 3 };
inline constexpr int kAxisCount = 4;
inline constexpr int kSlideCount = 3;  ///< X, Y, Z: what has ends and can be homed
inline constexpr int kExtruder = 3;
inline constexpr std::array<char, kAxisCount> kAxisLetter{'X', 'Y', 'Z', 'E'};
inline constexpr std::uint16_t kNotWired = 0xFFFF;

/// The limits of a stepper; see motor.h. Rates in microsteps.
struct MotorSpec {
    int microsteps = 16;  ///< 1, 2, 4, 8 or 16: how MS1–MS3 are wired
    /// Largest speed it starts at from rest: 750 full steps/s.
    double pull_in_steps_s = 12'000;
    double pull_out_steps_s = 32'000;  ///< largest speed at all: 2000 full steps/s
    /// How fast the speed may grow on top of the pull-in jump.
    double acceleration_steps_s2 = 1'000'000;
};

/// One motor with what it moves. Positions in mm of machine coordinates.
struct AxisSpec {
    double steps_per_mm = 80;
    std::uint16_t step_pin = kNotWired;
    std::uint16_t direction_pin = kNotWired;
    std::uint16_t enable_pin = kNotWired;
    std::uint16_t endstop_pin = kNotWired;  ///< high when pressed
    bool direction_inverted = false;        ///< DIR high moves towards minus
    double start_mm = 0;                    ///< where the carriage stands at power-on
    // Slides alone:
    double trigger_mm = 0;           ///< where the switch truly closes
    bool trigger_at_minimum = true;  ///< closed at and below trigger_mm, or at and above
    double hard_minimum_mm = -2;     ///< the frame: steps beyond are lost
    double hard_maximum_mm = 152;
    double home_mm = 0;     ///< the coordinate that the asked path gives to the switch
    Nanoseconds bounce{0};  ///< the contact chatters for this long after each change
    MotorSpec motor{};
};

/// One heater with its sensor; see heater.h.
struct HeaterSpec {
    std::uint16_t heater_pin = kNotWired;
    std::uint8_t adc_channel = 0;
    double power_w = 40;
    double heat_capacity_j_k = 22;  ///< 40 W: 20 → 210 °C in 137 s
    double loss_w_k = 0.09;
    double fan_loss_share = 0.25;  ///< the part fan at full duty adds this share of the loss
    double sensor_lag_s = 2.5;
    /// Heat that a mm³ of plastic takes away, for each kelvin above the room.
    double plastic_j_mm3_k = 0;
    device::Thermistor thermistor{};
};

/// A word of a file, and the lines that it stands for (asked_lines.h).
struct MacroSpec {
    std::string name;  ///< upper case
    std::string text;
};

inline constexpr int kHeaterCount = 2;
inline constexpr int kHotEnd = 0;
inline constexpr int kBed = 1;

struct Machine {
    std::array<AxisSpec, kAxisCount> axes{{
        {80, 2, 3, 4, 5, false, 37.3},
        {80, 6, 7, 8, 9, false, 51.1},
        {2020, 10, 11, 12, 13, false, 12.0},
        {96, 14, 15, 16, kNotWired, false, 0.0},
    }};
    std::array<HeaterSpec, kHeaterCount> heaters{{
        {17, 0, 40, 22, 0.09, 0.25, 2.5, 0.0022},  // PLA: 1.24 mg/mm³ · 1.8 J/(g K)
        {18, 1, 100, 400, 0.9, 0.05, 6.0, 0},
    }};
    std::uint16_t fan_pin = 19;
    int i2c_bus = -1;  ///< −1: the converter answers on every bus
    std::uint8_t adc_address = 0x48;
    double adc_reference_v = 3.3;  ///< feeds the REF pin and both thermistor dividers
    double ambient_celsius = 20;
    double filament_diameter_mm = 1.75;
    double nozzle_diameter_mm = 0.4;
    std::vector<MacroSpec> macros{};
    /// Plastic pushed at less than this is counted as a violation.
    double minimum_extrude_celsius = 160;

    /// Plastic in one microstep of the extruder.
    [[nodiscard]] double step_volume_mm3() const {
        return std::numbers::pi / 4 * filament_diameter_mm * filament_diameter_mm /
               axes[kExtruder].steps_per_mm;
    }
};

}  // namespace qduino::twin
