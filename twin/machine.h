// The machine that the twin is: its motors, slides, heaters and wiring, as a mechanic would measure
// them.
//
// The twin must not learn what the firmware believes, or it could not disprove it. So it does not
// see the printer's configuration. The defaults are the same reference machine (the paper's
// Printrbot Simple Metal with the heated-bed kit), written down a second time: a wrong steps/mm in
// either shows as a part of the wrong size. That check is lost where an app makes the twin from the
// printer's own machine file (config/twin_machine.h); printer-sim's --twin-machine gives
// the twin a file of its own.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "base/time.h"
#include "device/temperature_sensor.h"

namespace qduino::twin {

enum class Axis : std::uint8_t { x = 0, y = 1, z = 2, e = 3 };
inline constexpr int kAxisCount = 4;
inline constexpr int kSlideCount = 3;  ///< X, Y, Z: what has ends and can be homed
inline constexpr int kExtruder = 3;
inline constexpr std::array<char, kAxisCount> kAxisLetter{'X', 'Y', 'Z', 'E'};
inline constexpr std::uint16_t kNotWired = 0xFFFF;

/// In mm of machine coordinates. E: filament since the start, flow applied.
using Position = std::array<double, kAxisCount>;

/// The limits of a stepper; see motor.h. Rates in microsteps.
struct MotorSpec {
    int microsteps = 16;  ///< 1, 2, 4, 8 or 16: how MS1–MS3 are wired
    /// Largest speed it starts at from rest: 750 full steps/s.
    double pull_in_steps_s = 12'000;
    double pull_out_steps_s = 32'000;  ///< largest speed at all: 2000 full steps/s
    /// How fast the speed may grow on top of the pull-in jump.
    double acceleration_steps_s2 = 1'000'000;
};

/// What the motion along an axis is shaped with (compensation.h); in the order of Prusa's numbers.
enum class Shaper : std::uint8_t { none, zv, zvd, mzv, ei, two_hump_ei };
struct ShaperSpec {
    Shaper type = Shaper::none;
    double frequency_hz = 0;
    double damping_ratio = 0.1;
};

/// How motors move the nozzle (gantry.h).
enum class GantryType : std::uint8_t { cartesian, corexy, delta };

/// A delta's columns, which the carriages run on, and its arms.
struct DeltaSpec {
    double radius_mm = 0;  ///< sideways from joint to joint, the nozzle in the middle
    double arm_mm = 0;
    std::array<double, kSlideCount> angle_degrees{210, 330, 90};
};

/// One more motor that moves a slide, beside the first and on pins of its own.
struct ExtraMotorSpec {
    std::uint8_t slide = 0;
    std::uint16_t step_pin = kNotWired;
    std::uint16_t direction_pin = kNotWired;
    std::uint16_t enable_pin = kNotWired;
    std::uint16_t endstop_pin = kNotWired;  ///< a switch of its own end of the slide
    double start_mm = 0;                    ///< beside the first motor at power-on
};

/// A switch beside the nozzle that closes when the bed comes as near.
struct ProbeSpec {
    std::uint16_t pin = kNotWired;  ///< high when closed
    double x_offset_mm = 0, y_offset_mm = 0;
    double trigger_height_mm = 0;
};

/// The bed as it truly is: a plane that leans, with a round hill on it.
struct BedSpec {
    double lean_x = 0.0015, lean_y = -0.001;  ///< mm per mm, around the middle
    double middle_x_mm = 75, middle_y_mm = 75;
    double hill_mm = 0.12, hill_radius_mm = 45;
    double hill_x_mm = 95, hill_y_mm = 60;

    [[nodiscard]] double height_at(double x, double y) const {
        const double plane = lean_x * (x - middle_x_mm) + lean_y * (y - middle_y_mm);
        const double away2 = (x - hill_x_mm) * (x - hill_x_mm) + (y - hill_y_mm) * (y - hill_y_mm);
        return plane + hill_mm * std::exp(-away2 / (hill_radius_mm * hill_radius_mm));
    }
};

/// The grid on which a print measures the bed; pairs are of X and Y.
struct GridSpec {
    std::array<double, 2> minimum_mm{20, 20};
    std::array<double, 2> maximum_mm{130, 130};
    std::array<int, 2> points{5, 5};
    bool bicubic = false;
    double clearance_mm = 5;  ///< the nozzle's place behind the last point
    double fade_start_mm = 1, fade_end_mm = 10;
};

/// One motor, and the slide of its number. Positions in mm of machine coordinates; those of a
/// delta's slides are heights of carriages.
struct AxisSpec {
    double steps_per_mm = 80;
    std::uint16_t step_pin = kNotWired;
    std::uint16_t direction_pin = kNotWired;
    std::uint16_t enable_pin = kNotWired;
    std::uint16_t endstop_pin = kNotWired;  ///< high when pressed, unless endstop_pressed_low
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
    bool endstop_pressed_low = false;
    ShaperSpec shaper{};  ///< X and Y
    // What the firmware is told to keep: bounds of what filters do to a motion.
    double top_speed_mm_s = 125;
    double top_acceleration_mm_s2 = 2000;
    double corner_mm_s = 20;  ///< speed through a square corner; of Z and E the largest step of it
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
    device::TemperatureSensor sensor{};
};

/// The melt between the extruder's gear and the tip; see melt.h.
struct MeltSpec {
    /// The pressure of a push has left to 1/e after this: what slicers and Klipper's documentation
    /// call pressure advance, 0.02 to 0.1 s where the gear sits on the hot end.
    double pressure_s = 0.05;
    /// Runs out of a hot nozzle that nobody pushes or draws back …
    double idle_ooze_mm3 = 0.3;
    double idle_ooze_s = 10;  ///< … to 1/e in this time
};

/// A bed that was measured before the first job, and that a job may name.
struct KnownBedSpec {
    std::string name;
    GridSpec grid{};              ///< of it
    std::vector<double> heights;  ///< mm of the nozzle that would touch it; row by row
    bool in_force = false;        ///< a job that names none means it
};

/// A word of a file, and the lines that it stands for (asked_lines.h).
/// Whose firmware a job is written for: who says how the numbers of E count.
enum class Flavour : std::uint8_t { marlin, reprap, klipper };

struct MacroSpec {
    std::string name;  ///< upper case
    std::string text;
};

inline constexpr int kHeaterCount = 2;
inline constexpr int kHotEnd = 0;
inline constexpr int kBed = 1;

struct Machine {
    GantryType gantry = GantryType::cartesian;
    DeltaSpec delta{};
    std::array<AxisSpec, kAxisCount> axes{{
        {80, 2, 3, 4, 5, false, 37.3},
        {80, 6, 7, 8, 9, false, 51.1},
        {.steps_per_mm = 2020,
         .step_pin = 10,
         .direction_pin = 11,
         .enable_pin = 12,
         .endstop_pin = 13,
         .start_mm = 12.0,
         .top_speed_mm_s = 5,
         .top_acceleration_mm_s2 = 30,
         .corner_mm_s = 0.4},
        {.steps_per_mm = 96,
         .step_pin = 14,
         .direction_pin = 15,
         .enable_pin = 16,
         .top_speed_mm_s = 14,
         .top_acceleration_mm_s2 = 10000,
         .corner_mm_s = 5},
    }};
    std::array<HeaterSpec, kHeaterCount> heaters{{
        {17, 0, 40, 22, 0.09, 0.25, 2.5, 0.0022},  // PLA: 1.24 mg/mm³ · 1.8 J/(g K)
        {18, 1, 100, 400, 0.9, 0.05, 6.0, 0},
    }};
    std::vector<ExtraMotorSpec> extra_motors{};
    ProbeSpec probe{};
    BedSpec bed{};
    GridSpec grid{};
    std::array<double, 3> skew{};  ///< tangents by which the firmware must put the axes straight
    std::uint16_t fan_pin = 19;
    int i2c_bus = -1;  ///< −1: the converter answers on every bus
    std::uint8_t adc_address = 0x48;
    double adc_reference_v = 3.3;  ///< feeds the REF pin and both thermistor dividers
    double ambient_celsius = 20;
    double filament_diameter_mm = 1.75;
    double nozzle_diameter_mm = 0.4;
    double advance_s = 0;  ///< pressure advance: mm of filament ahead per mm/s
    double smooth_s = 0.04;
    MeltSpec melt{};
    std::vector<MacroSpec> macros{};
    std::optional<Flavour> flavour{};  ///< of every job; none: as the job says
    std::vector<KnownBedSpec> known_beds{};
    /// Plastic pushed at less than this is counted as a violation.
    double minimum_extrude_celsius = 160;

    /// Plastic in one microstep of the extruder.
    [[nodiscard]] double step_volume_mm3() const {
        return std::numbers::pi / 4 * filament_diameter_mm * filament_diameter_mm /
               axes[kExtruder].steps_per_mm;
    }
};

}  // namespace qduino::twin
