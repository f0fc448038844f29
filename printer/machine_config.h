// What kind of printer this is: the numbers that differ between printers, and nothing else.
//
// The defaults are the reference machine: the Printrbot Simple Metal of the paper (section IV),
// with the heated-bed kit. config reads the TOML form of this structure. Units here are
// SI seconds and millimetres.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <numbers>
#include <optional>

#include "base/fixed_string.h"
#include "base/fixed_vector.h"
#include "base/quantity.h"
#include "base/time.h"
#include "base/words.h"
#include "device/temperature_sensor.h"
#include "printer/heater_model.h"

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

/// No wire.
inline constexpr std::uint16_t kNoPin = 0xFFFF;

/// One more motor of an axis, on pins of its own: it makes every step that the first one makes.
struct ExtraMotor {
    std::uint16_t step_pin = kNoPin;
    std::uint16_t direction_pin = kNoPin;
    std::uint16_t enable_pin = kNoPin;
    /// High when pressed: while the axis homes, this motor stops here and the first one at the
    /// axis' own switch. kNoPin: both stop at that.
    std::uint16_t endstop_pin = kNoPin;
};
inline constexpr std::size_t kExtraMotorsMax = 3;

/// Input shapers (printer/motion/shaper.h).
enum class ShaperType : std::uint8_t { none, zv, zvd, mzv, ei, two_hump_ei };
struct ShaperConfig {
    ShaperType type = ShaperType::none;
    double frequency_hz = 0;  ///< of the machine's resonance along this axis; > 0 with a type
    double damping_ratio = 0.1;

    [[nodiscard]] constexpr bool active() const { return type != ShaperType::none && frequency_hz > 0; }
    friend constexpr bool operator==(const ShaperConfig&, const ShaperConfig&) = default;
};
/// No resonance of a printer is lower: bounds how much of the motion a shaper must know.
inline constexpr double kShaperFrequencyMin_hz = 10;
inline constexpr double kShaperFrequencyMax_hz = 500;
inline constexpr double kDampingRatioMax = 0.9;

/// Filament is pushed ahead of the motion by `advance` times its speed (printer/step/axis_path.h).
struct AdvanceConfig {
    Seconds advance{0};         ///< mm of filament per mm/s of it (M900 K); 0: none
    Seconds smooth_time{0.04};  ///< over which the push is spread
};
inline constexpr Seconds kAdvanceMax{2};
inline constexpr Seconds kSmoothTimeMin{0.001};
inline constexpr Seconds kSmoothTimeMax{0.2};

/// On a delta, X, Y and Z are also the towers A, B and C: pins, steps_per_mm, speed and
/// acceleration are their carriages' as well. On CoreXY, X and Y are also the motors A and B.
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
    /// Where an axis is expected to stand that has not been homed: so far from its switch. On a
    /// delta only Z's counts: the distance of the carriage that is farthest from its switch.
    Millimetres expected_from_switch{45};
    ShaperConfig shaper{};            ///< X and Y
    bool direction_inverted = false;  ///< DIR high moves towards minus
    std::uint16_t step_pin = 0;
    std::uint16_t direction_pin = 0;
    std::uint16_t enable_pin = 0;      ///< low enables (A4988)
    std::uint16_t endstop_pin = 0;     ///< unused for E
    bool endstop_pressed_low = false;  ///< all switches of the axis
    FixedVector<ExtraMotor, kExtraMotorsMax> extra_motors{};
};

enum class KinematicsType : std::uint8_t { cartesian, corexy, delta };
inline constexpr std::size_t kTowerCount = 3;

/// How motors move the tool (printer/kinematics.h draws it). All but the type concern a delta.
struct KinematicsConfig {
    KinematicsType type = KinematicsType::cartesian;
    /// Sideways from the joint on a carriage to that on the effector, the nozzle in the middle.
    Millimetres delta_radius{};
    Millimetres arm_length{};
    std::array<double, kTowerCount> tower_angle_degrees{210, 330, 90};  ///< from +X towards +Y
    /// How much higher than the others each switch is.
    std::array<Millimetres, kTowerCount> endstop_offset{};
    Millimetres home_height{};  ///< of the nozzle, all carriages at switches without an offset
    Millimetres bed_radius{};   ///< the bed is round, and its middle is X0 Y0
};

/// A switch that closes while the nozzle is `trigger_height` above the bed, or less.
struct ProbeConfig {
    std::uint16_t pin = kNoPin;  ///< high when triggered; kNoPin: there is none
    Millimetres x_offset{};      ///< of the probe from the nozzle
    Millimetres y_offset{};
    Millimetres trigger_height{};
    MillimetresPerSecond speed{5};
};

/// How a surface is laid through measured heights (printer/motion/bed_mesh.h).
enum class MeshSurface : std::uint8_t { bilinear, bicubic };
inline constexpr std::size_t kMeshPointsMax = 15;

/// The grid on which the bed is probed. Pairs are of X and Y.
struct MeshConfig {
    std::array<Millimetres, 2> minimum{Millimetres{20}, Millimetres{20}};  ///< of the probe's place
    std::array<Millimetres, 2> maximum{Millimetres{130}, Millimetres{130}};
    std::array<std::size_t, 2> points{5, 5};  ///< 2 to kMeshPointsMax
    MeshSurface surface = MeshSurface::bilinear;
    Millimetres clearance{5};  ///< Z of the nozzle on its way from point to point
    MillimetresPerSecond travel_speed{80};
    Millimetres fade_start{1};
    Millimetres fade_end{10};  ///< 0: the bed is followed however high the part

    friend bool operator==(const MeshConfig&, const MeshConfig&) = default;
};

/// A bed that was measured, by its name: a profile. M500 keeps it beyond the run.
struct KeptBed {
    FixedString<32> name{};
    bool in_force = false;                            ///< when it was kept; M420 S1 follows it
    std::array<Millimetres, 2> minimum{}, maximum{};  ///< of the grid, as MeshConfig's
    std::array<std::size_t, 2> points{2, 2};
    std::array<std::array<double, kMeshPointsMax>, kMeshPointsMax> heights{};  ///< [row][column]
};
inline constexpr std::size_t kBedProfilesMax = 4;
using KeptBeds = FixedVector<KeptBed, kBedProfilesMax>;
/// The profile that a bed without a name is kept as.
inline constexpr std::string_view kDefaultBed = "default";

/// What axes are off square: tangents of the angles that lack to 90° (printer/motion/correction.h).
struct SkewConfig {
    double xy = 0, xz = 0, yz = 0;

    friend bool operator==(const SkewConfig&, const SkewConfig&) = default;
};
inline constexpr double kSkewMax = 0.2;

/// How a heater's duty is decided (printer/heat).
enum class HeaterControl : std::uint8_t { model, pid };
inline constexpr Words<HeaterControl::model, HeaterControl::pid> kHeaterControlNames{"model", "pid"};

/// What tuning finds, and what may change while the printer runs: M301, M304, M306.
struct HeaterSettings {
    double kp = 0, ki = 0, kd = 0;
    HeaterModel model{};

    friend constexpr bool operator==(const HeaterSettings&, const HeaterSettings&) = default;
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
    HeaterControl control = HeaterControl::model;
    HeaterModel model{};
    device::SensorSpec sensor{};
    /// What the machine file says where kept numbers (M500) went before it.
    std::optional<HeaterSettings> factory{};
};

constexpr HeaterSettings settings_of(const HeaterConfig& heater) {
    return {heater.kp, heater.ki, heater.kd, heater.model};
}
/// What the machine file says, whatever is in force (M502).
constexpr HeaterSettings factory_settings_of(const HeaterConfig& heater) {
    return heater.factory.value_or(settings_of(heater));
}
constexpr void apply(const HeaterSettings& settings, HeaterConfig& heater) {
    heater.kp = settings.kp;
    heater.ki = settings.ki;
    heater.kd = settings.kd;
    heater.model = settings.model;
}

/// The largest target that a heater may be given: 15 °C below the fault, so that it may overshoot.
constexpr Celsius highest_target(const HeaterConfig& heater) { return heater.maximum + -15; }

/// A wait for `target` (M109) is content from here on.
constexpr Celsius content_from(const HeaterConfig& heater, Celsius target) {
    return target + -heater.at_target_celsius;
}

/// Where the head waits while a job is paused (printer/machine/parking.cpp).
struct ParkConfig {
    bool enabled = true;  ///< false: a pause stops where it is
    Millimetres x{0};     ///< machine coordinates; kept within the bounds of the axes
    Millimetres y{150};
    Millimetres z_hop{5};  ///< up before anything moves sideways; as far as the bounds allow
    Millimetres retract{2};
    MillimetresPerSecond speed{80};  ///< sideways; up and down at Z's own largest speed
    MillimetresPerSecond retract_speed{25};
    Millimetres unload{0};  ///< M600: drawn out at the park place, and pushed in again
    Millimetres purge{30};  ///< … and pushed on top, before it goes on
    MillimetresPerSecond purge_speed{4};
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

/// Whose meaning G90 and G91 have for E (printer/gcode/dialect.h).
enum class Dialect : std::uint8_t { marlin, reprap, klipper };

/// Lines in front of a job that brings no homing or no heating, if a person wants that
/// (printer/preflight/prologue.h).
struct StartConfig {
    /// With `{HOT_END}` and `{BED}` in it; empty: made from the machine's numbers.
    FixedString<768> text{};
    Celsius hot_end{200};  ///< where the slicer's comments do not say
    Celsius bed{60};
};

struct MachineConfig {
    FixedString<48> name{"Printrbot Simple Metal"};
    KinematicsConfig kinematics{};
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
         .expected_from_switch = 12_mm,
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
    /// mm/s³ along the path: the acceleration grows and falls no faster (printer/motion/s_curve.h).
    /// 0: it jumps (a trapezoid of speed).
    double jerk_mm_s3 = 0;
    AdvanceConfig pressure_advance;
    /// Below it filament does not move (may_extrude()); M302 S sets another limit for its job …
    Celsius minimum_extrude{170};
    Celsius minimum_extrude_floor{160};  ///< … and none below this
    /// Heaters that nobody uses go off after so long; 0: never.
    Seconds idle_timeout{600};
    /// It holds for every job; none: each job says it.
    std::optional<Dialect> dialect{};
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
                     .verify_error_celsius_s = 300,
                     .model = {.power_w = 100,
                               .heat_capacity_j_k = 400,
                               .loss_w_k = 0.896,
                               .fan_loss_w_k = 0,
                               .sensor_lag_s = 5.76,
                               .filament_j_mm3_k = 0}};
    Celsius room{20};  ///< where cold heaters start
    bool has_bed = true;
    ProbeConfig probe;
    MeshConfig mesh;
    KeptBeds beds{};  ///< that the printer knows at its start
    SkewConfig skew;
    std::uint16_t fan_pin = 19;
    std::uint8_t adc_address = 0x48;  ///< ADS7828
    // The stepper driver's timing: A4988.
    Nanoseconds step_pulse = 1us;         ///< STEP high at least
    Nanoseconds step_low = 1us;           ///< … and low at least
    Nanoseconds direction_setup = 200ns;  ///< DIR unchanged before and after the rising edge
    /// A step and one back that are nearer than this are not made: they would only tremble.
    Nanoseconds reversal_gap = 750us;
    /// What one step takes of loop 2's core on this computer, measured (step/step_cost.h); 0: not
    /// known, and no limit.
    Nanoseconds step_cost{};
    Millimetres filament_diameter{1.75};
    Millimetres nozzle_diameter{0.4};
    FixedVector<Macro, kMacrosMax> macros{};
    StartConfig start{};
};

/// The cross-section of the filament, mm²: so many mm³ are in a millimetre of it.
constexpr double filament_area_mm2(const MachineConfig& machine) {
    return std::numbers::pi / 4 * machine.filament_diameter.value() * machine.filament_diameter.value();
}

/// True when filament moves at `reading` although `limit` is the least. A hot end that has been
/// waited for may be a little below its target, so it may be as much below the limit: otherwise a
/// wait for the limit itself would end too early.
constexpr bool may_extrude(const MachineConfig& machine, Celsius limit, Celsius reading) {
    return reading >= content_from(machine.hot_end, limit);
}

/// X, Y and Z at their endstops; E at 0.
constexpr PerAxis<Millimetres> home_positions(const MachineConfig& machine) {
    PerAxis<Millimetres> home{};
    for (const Axis axis : {Axis::x, Axis::y, Axis::z}) home[axis] = machine.axes[axis].home_position;
    return home;
}

/// Where an axis is expected that has not been homed (expected_from_switch), within its bounds.
constexpr Millimetres expected_place(const AxisConfig& axis) {
    const double sign = axis.home_towards_minimum ? 1 : -1;
    return std::clamp(axis.home_position + axis.expected_from_switch * sign, axis.minimum, axis.maximum);
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
