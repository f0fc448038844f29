// What G-code asks of a machine. The interpreter reaches the machine through this interface only.
//
//   bytes ─► LineReader ─► Parser ─► Command ─► Interpreter ─► Actions  (this file)
//                                               modal state    machine, pre-flight, test recorder
//
// The interpreter resolves units, coordinates and modes before it calls. What arrives here is in
// millimetres and seconds, in machine coordinates, with the factors applied and the ranges checked
// against the machine. An implementation needs to know nothing of G90 or of inches.
//
// No action blocks. The machine queues what takes time (a move, a wait, a homing), and feeds the
// next command when it has room or when the wait is over. An action may refuse (a cold nozzle, a
// latched fault). The interpreter then returns the error, and its modal state stays as it was
// before the command.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "base/quantity.h"
#include "base/result.h"
#include "printer/gcode/position.h"
#include "printer/gcode/source.h"
#include "printer/machine_config.h"

namespace qduino::printer::gcode {

enum class MoveKind : std::uint8_t {
    travel,    ///< the tool moves, no filament does
    print,     ///< the tool moves and filament with it, either way
    filament,  ///< E alone: retraction, priming
};

/// A straight line in machine coordinates. `from` never equals `to`; both are finite and inside the
/// bounds.
struct Move {
    Position from;
    Position to;
    /// Asked speed, after M220, above 0: along X, Y, Z together; of the filament when E moves
    /// alone. The machine's own limits are not applied yet: that is the planner's work.
    MillimetresPerSecond feedrate;
    MoveKind kind = MoveKind::travel;
    bool firmware_retract = false;  ///< G10 or G11 made it
    /// The line that asked for it; the pieces of an arc share theirs.
    Source source;
    /// What `feedrate` was made of: the speed before M220, and the most that it may become. With
    /// the factors in it, a machine can give what is left of a long move other factors.
    MillimetresPerSecond feedrate_asked{};
    MillimetresPerSecond feedrate_most{};
    double speed_factor = 1;
    double flow_factor = 1;
};

enum class Heater : std::uint8_t { hot_end, bed };

struct WaitFor {
    enum Kind : std::uint8_t {
        heating,             ///< M109 S: done as soon as the temperature is not below the target
        heating_or_cooling,  ///< M109 R: done when the target is reached from either side
        between,             ///< TEMPERATURE_WAIT: done between two temperatures, both included
    };

    constexpr WaitFor(Kind what) : kind(what) {}  // NOLINT: it is one
    constexpr WaitFor(Celsius from, Celsius to) : kind(between), lowest(from), highest(to) {}

    Kind kind;
    Celsius lowest{}, highest{};  ///< of `between`

    friend constexpr bool operator==(const WaitFor&, const WaitFor&) = default;
};

/// M201, M203, M204, M205, M302: a limit that is not given stays as it is. A limit of motion is
/// never above the machine's own configuration.
struct LimitChange {
    PerAxis<std::optional<MillimetresPerSecond2>> axis_acceleration{};
    PerAxis<std::optional<MillimetresPerSecond>> axis_speed{};
    PerAxis<std::optional<MillimetresPerSecond>> axis_instantaneous_speed{};
    std::optional<MillimetresPerSecond2> print_acceleration{};
    std::optional<MillimetresPerSecond2> filament_acceleration{};
    std::optional<MillimetresPerSecond2> travel_acceleration{};
    std::optional<Millimetres> junction_deviation{};
    std::optional<Celsius> minimum_extrude{};  ///< not below the machine file's floor
};

/// M593, M900, M572 and Klipper's words for them: what is not given stays as it is.
struct CompensationChange {
    struct Shaper {
        std::optional<ShaperType> type{};
        /// For an axis that has had none yet.
        ShaperType type_at_first = ShaperType::zv;
        std::optional<double> frequency_hz{};  ///< 0: no shaper
        std::optional<double> damping_ratio{};
    };
    std::array<Shaper, 2> shapers{};   ///< X, Y
    std::optional<Seconds> advance{};  ///< pressure advance: mm per mm/s of filament
    std::optional<Seconds> smooth_time{};
};

enum class BedProfile : std::uint8_t { none, save, load, remove };

/// M420, M852, BED_MESH_… and SET_SKEW: what is not given stays as it is.
struct BedChange {
    std::optional<bool> follow{};  ///< the measured bed
    bool forget = false;           ///< what was measured
    std::optional<Millimetres> fade_end{};
    BedProfile profile = BedProfile::none;
    std::string_view name{};  ///< of the profile
    std::optional<SkewConfig> skew{};
};

enum class Report : std::uint8_t {
    temperatures,
    position,
    firmware,
    hot_end_gains,  ///< M301, M304, M306 without a number
    bed_gains,
    hot_end_model,
    bed_model,
    heat_settings,  ///< M503
    progress,       ///< M73
};                  ///< M105, M114, M115 (reports.h formats them)

/// M301, M304, M306: a number that is not given stays as it is. Units: HeaterConfig, HeaterModel.
struct HeaterChange {
    std::optional<double> kp{}, ki{}, kd{};
    std::optional<double> power_w{}, heat_capacity_j_k{}, sensor_lag_s{}, loss_w_k{}, filament_j_mm3_k{};
    std::optional<double> loss_with_fan_w_k{};  ///< loss_w_k and fan_loss_w_k together
};

/// M303, M306 T: an experiment that finds a heater's numbers.
struct TuningAsked {
    Heater heater = Heater::hot_end;
    HeaterControl kind = HeaterControl::pid;
    Celsius target{};
    int swings = 5;
    bool use = false;  ///< put what was found in force
};

/// M500 keeps the settings in force beyond this run, M501 goes back to those kept.
enum class SettingsAsked : std::uint8_t {
    keep,     ///< M500
    restore,  ///< M501: what was kept
    factory,  ///< M502: what the machine file says
};

enum class PauseReason : std::uint8_t { requested, filament_change };  ///< M0 M1 M601; M600

/// A pause, and what its code asks for instead of the machine file's [park].
struct PauseOrder {
    PauseReason reason = PauseReason::requested;
    std::string_view text{};  ///< for people; empty: the message stays
    std::optional<Millimetres> x{}, y{}, lift{};
    std::optional<Millimetres> retract{};
    std::optional<Millimetres> unload{}, purge{};  ///< of a filament change
};

enum class NoteKind : std::uint8_t {
    echo,          ///< M118: text for the host
    unknown_code,  ///< no such code; it was skipped
    not_done,      ///< a known code that this version does not carry out; it was skipped
    warning,       ///< carried out, but look at this
};

/// M73. A value that is not given stays as it is.
struct Progress {
    std::optional<double> percent{};     ///< 0…100
    std::optional<Seconds> remaining{};  ///< not negative
};

/// Implemented by the machine. Called from Interpreter::execute and ::proceed alone, in the order
/// of the job.
class Actions {
  public:
    virtual ~Actions() = default;

    virtual Result<void> move(const Move& move) = 0;
    /// After all moves so far have been carried out, waits `duration`. Zero (G4 S0, M400) only
    /// waits for the moves.
    virtual Result<void> dwell(Seconds duration) = 0;
    /// Homes `axes` (X, Y, Z; never empty). Afterwards each of them stands at its
    /// AxisConfig::home_position_mm: the interpreter assumes so at once, and
    /// Interpreter::set_position corrects it if the homing fails.
    virtual Result<void> home(AxisSet axes) = 0;
    /// Measures the bed, and follows it from the next move on. The nozzle then stands where
    /// printer/probe_grid.h says, at the clearance.
    virtual Result<void> probe_bed() = 0;
    /// From the next move on, which first goes to where it begins.
    virtual Result<void> change_bed(const BedChange& change) = 0;
    /// `target` is 0 °C (off) up to 15 °C below the heater's maximum. Takes effect in the order of
    /// the moves.
    virtual Result<void> set_temperature(Heater heater, Celsius target) = 0;
    /// Sets the target, then holds the job until it is reached.
    virtual Result<void> wait_temperature(Heater heater, Celsius target, WaitFor direction) = 0;
    /// Other gains, another model. At once.
    virtual Result<void> set_heater(Heater heater, const HeaterChange& change) = 0;
    /// Holds the job until the experiment is over.
    virtual Result<void> tune_heater(const TuningAsked& asked) = 0;
    virtual Result<void> settings(SettingsAsked asked) = 0;
    /// `duty` 0…1. Fan 0 is the part cooling fan.
    virtual Result<void> set_fan(std::uint8_t index, double duty) = 0;
    /// The axes may be moved by hand from here on, so the tool axes among them are no longer homed.
    virtual Result<void> motors_off(AxisSet axes) = 0;
    /// M84 S: motors that nobody has moved for `after` go off; 0: never. Not while a job runs.
    virtual Result<void> motors_time_out(Seconds after) = 0;
    virtual Result<void> set_limits(const LimitChange& change) = 0;
    /// For the moves from here on.
    virtual Result<void> set_compensation(const CompensationChange& change) = 0;
    /// M220, M221: for display only; moves come with both applied.
    virtual void factors(double speed, double flow) = 0;
    /// M117; empty clears it. UTF-8, without control characters.
    virtual void message(std::string_view text) = 0;
    virtual void progress(const Progress& progress) = 0;
    virtual void report(Report what) = 0;
    virtual Result<void> pause(const PauseOrder& order) = 0;
    /// M112. At once, and never refused.
    virtual void emergency_stop() = 0;
    /// Text for people, on one line; `source` is the line that caused it.
    virtual void note(NoteKind kind, std::string_view text, const Source& source) = 0;
};

}  // namespace qduino::printer::gcode
