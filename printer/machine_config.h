// What kind of machine this is: the numbers that differ between printers, and nothing else.
//
// The defaults are the reference machine: the Printrbot Simple Metal of the paper (section IV), with the
// heated-bed kit. The TOML form of this structure is read in apps/ (machine files); units here are SI seconds
// and millimetres.
#pragma once

#include <array>
#include <cstdint>

#include "base/fixed_string.h"
#include "base/quantity.h"

namespace qduino::printer {

enum class Axis : std::uint8_t { x = 0, y = 1, z = 2, e = 3 };
inline constexpr int kAxisCount = 4;

/// One value for each axis, in the order of Axis; aggregate, laid out as the array it is.
template <typename T>
struct PerAxis : std::array<T, kAxisCount> {
    using std::array<T, kAxisCount>::operator[];
    constexpr T& operator[](Axis axis) { return (*this)[static_cast<std::size_t>(axis)]; }
    constexpr const T& operator[](Axis axis) const { return (*this)[static_cast<std::size_t>(axis)]; }
};
inline constexpr PerAxis<char> kAxisLetter{'X', 'Y', 'Z', 'E'};

struct AxisConfig {
    double steps_per_mm = 80;
    double max_speed_mm_s = 125;
    double max_acceleration_mm_s2 = 2000;
    double instantaneous_speed_mm_s =
        20;                 ///< largest speed step at a corner (M205); for X and Y the square-corner velocity
    double minimum_mm = 0;  ///< bounds, X Y Z; E has none
    double maximum_mm = 150;
    double home_speed_mm_s = 30;  ///< first approach; the second is at a tenth of it
    double home_retreat_mm = 3;
    double home_position_mm = 0;  ///< coordinate at the endstop
    bool home_towards_minimum = true;
    bool direction_inverted = false;  ///< DIR high moves towards minus
    std::uint16_t step_pin = 0;
    std::uint16_t direction_pin = 0;
    std::uint16_t enable_pin = 0;   ///< low enables (A4988)
    std::uint16_t endstop_pin = 0;  ///< high when pressed; unused for E
};

struct HeaterConfig {
    double kp = 22.2, ki = 1.08, kd = 114;  ///< output 0…255, temperature in °C, time in s (Marlin's units)
    double minimum_celsius = 5;             ///< a reading below this is a broken sensor
    double maximum_celsius = 275;  ///< a reading above this is a fault; the largest target is 15 below
    std::uint16_t heater_pin = 0;
    std::uint8_t adc_channel = 0;
    // Heater verification (facts: Klipper verify_heater, Marlin thermal protection: docs/sources.md)
    double verify_gain_celsius = 2;  ///< while heating up it must gain this much …
    double verify_gain_s = 20;       ///< … within this time
    double verify_hysteresis_celsius =
        5;  ///< at temperature, the error below target − hysteresis accumulates …
    double verify_error_celsius_s = 120;  ///< … up to this many °C·s
    double at_target_celsius = 1.0;       ///< M109/M190: reached when within this, for `at_target_s`
    double at_target_s = 1.0;
};

/// The largest target that a heater may be given: the heat must have room to overshoot below the fault.
constexpr Celsius highest_target(const HeaterConfig& heater) { return Celsius{heater.maximum_celsius - 15}; }

/// Where the head waits while a job is paused (printer/machine/parking.cpp).
struct ParkConfig {
    bool enabled = true;  ///< false: a pause stops where it is
    double x_mm = 0;      ///< machine coordinates; kept within the bounds of the axes
    double y_mm = 150;
    double z_hop_mm = 5;  ///< up before anything moves sideways; as far as the bounds allow
    double retract_mm = 2;
    double speed_mm_s = 80;  ///< sideways; up and down at Z's own largest speed
    double retract_speed_mm_s = 25;
};

struct MachineConfig {
    FixedString<48> name{"Printrbot Simple Metal"};
    PerAxis<AxisConfig> axes{{{
        {80, 125, 2000, 20, 0, 150, 40, 3, 0, true, false, 2, 3, 4, 5},
        {80, 125, 2000, 20, 0, 150, 40, 3, 0, true, false, 6, 7, 8, 9},
        {2020, 5, 30, 0.4, 0, 150, 4, 1, 0, true, false, 10, 11, 12, 13},
        {96, 14, 10000, 5, -1e9, 1e9, 0, 0, 0, true, false, 14, 15, 16, 0},
    }}};
    double default_acceleration_mm_s2 = 3000;
    double travel_acceleration_mm_s2 = 3000;
    double minimum_extrude_celsius = 170;
    double idle_timeout_s = 600;  ///< heaters that nobody uses go off after so long; 0: never
    ParkConfig park;
    HeaterConfig hot_end{22.2, 1.08, 114, 5, 275, 17, 0, 2, 20, 5, 120, 1.0, 1.0};
    HeaterConfig bed{10, 0.023, 305.4, 5, 125, 18, 1, 2, 60, 5, 300, 1.0, 1.0};
    bool has_bed = true;
    std::uint16_t fan_pin = 19;
    std::uint8_t adc_address = 0x48;    ///< ADS7828
    double step_pulse_s = 1e-6;         ///< A4988: STEP high at least 1 µs …
    double step_low_s = 1e-6;           ///< … and low at least 1 µs
    double direction_setup_s = 200e-9;  ///< DIR valid before and after the rising edge
    double filament_diameter_mm = 1.75;
    double nozzle_diameter_mm = 0.4;
};

}  // namespace qduino::printer
