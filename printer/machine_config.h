// What kind of printer this is: the numbers that differ between printers, and nothing else.
//
// The defaults are the reference machine: the Printrbot Simple Metal of the paper (section IV),
// with the heated-bed kit. apps/machine_file reads the TOML form of this structure. Units here are
// SI seconds and millimetres.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "base/fixed_string.h"
#include "base/fixed_vector.h"
#include "base/quantity.h"
#include "base/time.h"

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
    double steps_per_mm = 0;
    MillimetresPerSecond max_speed{};
    MillimetresPerSecond2 max_acceleration{};
    /// Largest speed step at a corner (M205); of X and Y the speed through a square corner.
    MillimetresPerSecond instantaneous_speed{};
    Millimetres minimum{};  ///< bounds, X Y Z; E has none
    Millimetres maximum{};
    MillimetresPerSecond home_speed{};  ///< first approach; the second is at a tenth of it
    Millimetres home_retreat{};
    Millimetres home_position{};  ///< coordinate at the endstop
    bool home_towards_minimum = true;
    bool direction_inverted = false;  ///< DIR high moves towards minus
    std::uint16_t step_pin = 0;
    std::uint16_t direction_pin = 0;
    std::uint16_t enable_pin = 0;   ///< low enables (A4988)
    std::uint16_t endstop_pin = 0;  ///< high when pressed; unused for E
};

/// Differences of temperatures are plain numbers, in kelvin.
struct HeaterConfig {
    double kp = 0, ki = 0, kd = 0;  ///< output 0…255, temperature in °C, time in s (Marlin's units)
    Celsius minimum{5};             ///< a reading below this is a broken sensor
    Celsius maximum{};              ///< a reading above this is a fault; see highest_target()
    std::uint16_t heater_pin = 0;
    std::uint8_t adc_channel = 0;
    // Heater verification (docs/sources.md: Klipper's verify_heater, Marlin's thermal protection).
    double verify_gain_celsius = 2;  ///< while heating up it must gain this much …
    Seconds verify_gain_time{20};    ///< … within this time
    /// At temperature, the error below target − hysteresis accumulates …
    double verify_hysteresis_celsius = 5;
    double verify_error_celsius_s = 120;  ///< … up to this many °C·s
    double at_target_celsius = 1;         ///< M109, M190: reached when within this …
    Seconds at_target_time{1};            ///< … for this time
};

/// The largest target that a heater may be given: 15 °C below the fault, so that it may overshoot.
constexpr Celsius highest_target(const HeaterConfig& heater) { return heater.maximum + -15; }

/// Where the head waits while a job is paused (printer/machine/parking.cpp).
struct ParkConfig {
    bool enabled = true;  ///< false: a pause stops where it is
    Millimetres x{0};     ///< machine coordinates; kept within the bounds of the axes
    Millimetres y{150};
    Millimetres z_hop{5};  ///< up before anything moves sideways; as far as the bounds allow
    Millimetres retract{2};
    MillimetresPerSecond speed{80};  ///< sideways; up and down at Z's own largest speed
    MillimetresPerSecond retract_speed{25};
};

/// A word of a job, and the lines that it stands for (printer/gcode/expansion.h).
struct Macro {
    FixedString<32> name{};   ///< upper case
    FixedString<768> text{};  ///< lines, with `{PARAMETER}` or `{PARAMETER=default}` in them
};
inline constexpr std::size_t kMacrosMax = 12;

/// X and Y of the reference machine; `pin` is the first of the four.
constexpr AxisConfig belt_axis(std::uint16_t pin) {
    return {.steps_per_mm = 80,
            .max_speed = 125_mm_s,
            .max_acceleration = 2000_mm_s2,
            .instantaneous_speed = 20_mm_s,
            .minimum = 0_mm,
            .maximum = 150_mm,
            .home_speed = 40_mm_s,
            .home_retreat = 3_mm,
            .step_pin = pin++,
            .direction_pin = pin++,
            .enable_pin = pin++,
            .endstop_pin = pin};
}

struct MachineConfig {
    FixedString<48> name{"Printrbot Simple Metal"};
    PerAxis<AxisConfig> axes{{{
        belt_axis(2),
        belt_axis(6),
        {.steps_per_mm = 2020,
         .max_speed = 5_mm_s,
         .max_acceleration = 30_mm_s2,
         .instantaneous_speed = 0.4_mm_s,
         .minimum = 0_mm,
         .maximum = 150_mm,
         .home_speed = 4_mm_s,
         .home_retreat = 1_mm,
         .step_pin = 10,
         .direction_pin = 11,
         .enable_pin = 12,
         .endstop_pin = 13},
        {.steps_per_mm = 96,
         .max_speed = 14_mm_s,
         .max_acceleration = 10000_mm_s2,
         .instantaneous_speed = 5_mm_s,
         .minimum = -1e9_mm,
         .maximum = 1e9_mm,
         .step_pin = 14,
         .direction_pin = 15,
         .enable_pin = 16},
    }}};
    MillimetresPerSecond2 default_acceleration{3000};
    MillimetresPerSecond2 travel_acceleration{3000};
    Celsius minimum_extrude{170};  ///< below it filament does not move
    Seconds idle_timeout{600};     ///< heaters that nobody uses go off after so long; 0: never
    ParkConfig park;
    HeaterConfig hot_end{
        .kp = 22.2, .ki = 1.08, .kd = 114, .maximum = 275_celsius, .heater_pin = 17, .adc_channel = 0};
    HeaterConfig bed{.kp = 10,
                     .ki = 0.023,
                     .kd = 305.4,
                     .maximum = 125_celsius,
                     .heater_pin = 18,
                     .adc_channel = 1,
                     .verify_gain_time = Seconds{60},
                     .verify_error_celsius_s = 300};
    bool has_bed = true;
    std::uint16_t fan_pin = 19;
    std::uint8_t adc_address = 0x48;  ///< ADS7828
    // The stepper driver's timing: A4988.
    Nanoseconds step_pulse = 1us;         ///< STEP high at least
    Nanoseconds step_low = 1us;           ///< … and low at least
    Nanoseconds direction_setup = 200ns;  ///< DIR unchanged before and after the rising edge
    /// What one step takes of loop 2's core on this computer, measured (step/step_cost.h); 0: not
    /// known, and no limit.
    Nanoseconds step_cost{};
    Millimetres filament_diameter{1.75};
    Millimetres nozzle_diameter{0.4};
    FixedVector<Macro, kMacrosMax> macros{};
};

/// X, Y and Z at their endstops; E at 0.
constexpr PerAxis<Millimetres> home_positions(const MachineConfig& machine) {
    PerAxis<Millimetres> home{};
    for (const Axis axis : {Axis::x, Axis::y, Axis::z}) home[axis] = machine.axes[axis].home_position;
    return home;
}

/// Shortest time from one rising edge of a motor's STEP pin to the next, turning back or not: the
/// player's drawing (step/player.h). DIR stays while STEP is high, and may change as soon as it is
/// low.
constexpr Nanoseconds step_interval(const MachineConfig& machine) {
    return std::max(machine.step_pulse, machine.direction_setup) +
           std::max(machine.step_low, machine.direction_setup);
}

/// The share of its core that the player may fill with steps. The rest is for interrupts, for the
/// looks at the ring, and for catching up.
inline constexpr double kStepShare = 0.7;

/// All motors together: the most steps in a second that the core plays without falling behind. 0:
/// not known.
constexpr double step_rate_limit_hz(Nanoseconds step_cost) {
    return step_cost > Nanoseconds{0} ? kStepShare / to_seconds(step_cost) : 0;
}

}  // namespace qduino::printer
