// The handlers of the G-codes work on this: the modal state, the machine's numbers, the way out to
// the machine.
//
//   G20 G21           units of length            F            modal speed
//   G90 G91 M82 M83   absolute or relative       M220 M221    factors of speed and flow
//   G92 M206          where zero is              G10 G11      retraction
//   G17 G18 G19       the plane of arcs          M200 M92     what a word of E pushes
//
// All of it lives in ModalState, and nowhere else. Beside it: objects that are left out
// (objects.h), a curve (curve.h) or lines (expansion.h) that are begun.
//
// For handlers and the interpreter alone. Their bodies: handlers_motion.cpp, handlers_state.cpp,
// handlers_machine.cpp, handlers_compensation.cpp, handlers_words.cpp.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "base/fixed_vector.h"
#include "base/quantity.h"
#include "base/result.h"
#include "printer/gcode/actions.h"
#include "printer/gcode/command_table.h"
#include "printer/gcode/curve.h"
#include "printer/gcode/expansion.h"
#include "printer/gcode/name_key.h"
#include "printer/gcode/objects.h"
#include "printer/gcode/position.h"
#include "printer/kinematics.h"
#include "printer/machine_config.h"

namespace qduino::printer::gcode {

/// A coordinate may be this far outside of the bounds by rounding (inch files); it is then put onto
/// the bound.
inline constexpr Millimetres kBoundsTolerance{0.001};
/// Speeds are kept between these, so that the time of every move stays a sane number. The machine's
/// own limits are far inside.
inline constexpr MillimetresPerSecond kSlowest{0.001};
inline constexpr MillimetresPerSecond kFastest{100'000};
/// The range of the accelerations that a job may ask for.
inline constexpr double kAccelerationMin_mm_s2 = 0.1;
inline constexpr double kAccelerationMax_mm_s2 = 1e6;
/// More filament than this in one move is a slip, not a wish (a forgotten G92 E0): it is refused.
inline constexpr Millimetres kLongestExtrusion{1000};
inline constexpr Seconds kLongestDwell{86400};

/// Firmware retraction: M207 and M208 set it, G10 and G11 use it. Defaults are Marlin's.
struct RetractionSettings {
    Millimetres length{3};
    MillimetresPerSecond speed{45};
    Millimetres lift{0};
    Millimetres extra_on_recover{0};
    MillimetresPerSecond recover_speed{8};
};

struct ModalState {
    double unit_mm = 1;            ///< millimetres in a unit of length: 1, or 25.4 after G20
    bool relative = false;         ///< G91: X, Y, Z
    bool relative_e = false;       ///< M83; in Marlin's dialect G91, too
    bool said_relative_e = false;  ///< by the last M82 or M83
    bool axes_came_last = false;   ///< a G90 or G91 came behind it
    Dialect dialect = Dialect::marlin;
    MillimetresPerSecond feedrate{25};
    double speed_factor = 1;                      ///< M220
    double speed_factor_kept = 1;                 ///< M220 B keeps, M220 R restores
    double flow_factor = 1;                       ///< M221
    double filament_scale = 1;                    ///< M92 E, by the machine file's steps per mm
    bool volumetric = false;                      ///< M200: E is in mm³
    double filament_area_mm2 = 0;                 ///< M200 D
    double flow_limit_mm3_s = 0;                  ///< M200 L, of moves that print; 0: none
    MillimetresPerSecond speed_limit = kFastest;  ///< SET_VELOCITY_LIMIT, of the tool
    ArcPlane plane = ArcPlane::xy;
    Position machine;           ///< where the last accepted move ends
    Position offset;            ///< machine = programmed + offset, for X, Y, Z
    Position home_offset;       ///< M206: part of the offset, and outlasts a G28; taken off
    Position code_offset;       ///< SET_GCODE_OFFSET: likewise; added
    Millimetres filament_peak;  ///< the furthest that E of `machine` has been
    Celsius hot_end_target{};
    Celsius bed_target{};
    Celsius minimum_extrude{};     ///< M302
    Millimetres programmed_e;      ///< E as G-code counts it; G92 sets it, flow does not scale it
    PerAxis<bool> homed{};         ///< X, Y, Z
    PerAxis<bool> homed_by_job{};  ///< … by a G28 of this job: `G28 O` asks for that
    SkewConfig skew{};             ///< M852; outlasts a job
    PerAxis<bool> warned_unhomed{};
    RetractionSettings retraction{};
    bool retracted = false;
    Millimetres retracted_length;  ///< by the G10 in force
    Millimetres lifted;            ///< likewise; part of Z's offset

    /// E counts on from where it is.
    [[nodiscard]] bool counts_e_on() const { return relative_e || (relative && dialect != Dialect::marlin); }
    /// Millimetres, or mm³ while extrusion is volumetric, in a unit of E.
    [[nodiscard]] double filament_unit() const { return volumetric ? unit_mm * unit_mm * unit_mm : unit_mm; }
    /// Millimetres of filament that one of E's pushes.
    [[nodiscard]] double filament_factor() const {
        return flow_factor * filament_scale / (volumetric ? filament_area_mm2 : 1.0);
    }
    void set_homed(Axis axis, bool is_homed) {
        homed[axis] = is_homed;
        homed_by_job[axis] = homed_by_job[axis] && is_homed;
        warned_unhomed[axis] = false;
    }
};

/// SAVE_GCODE_STATE: modes, coordinates, factors and place. Klipper's set of them.
struct SavedState {
    NameKey name{};
    ModalState state{};
};

struct Context {
    static constexpr std::size_t kSavedMax = 4;

    MachineConfig config;
    Actions& actions;
    Kinematics kinematics{config};
    ModalState state{};
    Source source{};               ///< of the command in hand
    std::optional<Curve> curve{};  ///< begun; the interpreter hands its chords on
    Expansion lines{};             ///< begun; the interpreter carries them out
    Objects objects{};
    FixedVector<SavedState, kSavedMax> saved{};
    /// Where the head waits while objects are left out: `state.machine` goes on without it.
    std::optional<Position> left_at{};
    Millimetres drawn_when_left{};  ///< how far the filament was drawn back there
    Position rejoined_at{};         ///< where the last such wait ended
    std::uint32_t warnings = 0;
    /// The last line whose E Marlin's dialect has read and others would have read otherwise; 0:
    /// none.
    std::uint64_t e_disputed = 0;
    std::uint64_t dialect_line = 0;  ///< that has said it; 0: none
    bool said_how_e_counts = false;
    bool program_ended = false;  ///< M2, M30
    bool not_done = false;       ///< the machine lacks what the command in hand is for: skip it

    /// Hands on a straight line from `state.machine` to `target`, at `feedrate` and M220; none when
    /// it has no length. `target` has been checked.
    /// While the head waits (objects.h), only a firmware retraction moves the machine; behind the
    /// object also what takes it out of the part: a retraction, and a way up.
    Result<void> move_to(const Position& target, MillimetresPerSecond feedrate,
                         bool firmware_retract = false);
    /// Before a move sideways to `target`: brings a head that waited while objects were left out to
    /// that place, up, sideways and down, with the filament drawn back as far as the program takes
    /// it to be. Up to four moves. Filament that was left out is not counted: E of the state and of
    /// `target` follow. Nothing to do: the head did not wait, or goes on waiting.
    Result<void> rejoin(Position& target);
    /// The line that rejoined has been refused: the head waits on, where it is by now, and the
    /// state is as `before` that line. Nothing to do: the line has moved the head since, or
    /// nothing waited.
    void wait_on(const ModalState& before);
    /// Before the head is taken to another place than the program's or is left alone (a homing, a
    /// look at the bed, motors that go off, the end): where it waits, it goes up as far as the
    /// program is, and the filament comes to where the program takes it to be. Up to three moves.
    Result<void> settle();
    /// The program goes on from where the head is, if that waits.
    void stop_waiting();
    /// Likewise, if the head has come to where the program is.
    void stop_waiting_there();
    /// The machine stands somewhere else than the moves said. The program's place moves along.
    void stand_at(const Position& machine);
    /// True when a move to `target` goes sideways: a head that waits then waits no longer.
    [[nodiscard]] bool goes_sideways(const Position& target) const {
        return target[Axis::x] != state.machine[Axis::x] || target[Axis::y] != state.machine[Axis::y];
    }
    /// Error: out of the machine's bounds, or too much filament. Puts a rounding error onto the
    /// bound.
    Result<void> check_target(Position& target) const;
    void warn(std::string_view text);
    /// G90 or G91.
    void count_axes_on(bool relative);
    /// A move with E is about to be made: where another dialect would count its E otherwise, that
    /// is kept, and said once.
    void note_e();

  private:
    /// Filament that is to be pushed (negative: drawn back) until it is where the program takes it
    /// to be. Contract: the head waits.
    [[nodiscard]] Millimetres owed() const;
    Result<void> bring_filament(Millimetres length, MillimetresPerSecond speed);
    Result<void> rise_to(Millimetres z, MillimetresPerSecond speed);
    Result<void> follow_in_place(const Position& target, MillimetresPerSecond feedrate);
    [[nodiscard]] MillimetresPerSecond fastest(const Position& from, const Position& to, MoveKind kind) const;
    Result<void> hand_on(const Position& from, const Position& to, MillimetresPerSecond feedrate,
                         bool firmware_retract);
    [[nodiscard]] Result<void> check_room(const Position& target) const;
    void warn_unhomed(const Position& target);
};

/// The number behind `letter`; none when the letter is absent; an error when it stands alone.
Result<std::optional<double>> number(const Command& command, char letter);
/// As above, and an error unless `low` ≤ value ≤ `high`. `unit` is for the error's text.
Result<std::optional<double>> number_within(const Command& command, char letter, double low, double high,
                                            std::string_view unit);
Error outside(char letter, double value, double low, double high, std::string_view unit);
/// Puts the number behind `letter` times `scale` into `value`, a quantity, if it is given. Error:
/// it is then not from `low` to `high`.
template <typename Value>
Result<void> take_scaled(const Command& command, char letter, double scale, double low, double high,
                         Value& value, std::string_view unit) {
    QDUINO_TRY_ASSIGN(const auto given, number(command, letter));
    if (!given) return {};
    const double scaled = *given * scale;
    if (!(scaled >= low && scaled <= high)) return outside(letter, scaled, low, high, unit);
    value = Value{scaled};
    return {};
}
/// S behind `tool_letter`, a tool's number: the hot end's target. For a tool that is not there, off
/// is harmless, and heat is an error.
Result<void> set_tool_temperature(Context& context, const Command& command, char tool_letter);
/// Sets a target, or also waits for it, and keeps it in the modal state.
Result<void> set_target(Context& context, Heater heater, Celsius target,
                        std::optional<WaitFor> wait = std::nullopt);
/// The axes whose letters stand in the command; `otherwise` when none does.
AxisSet axes_of(const Command& command, AxisSet otherwise);

}  // namespace qduino::printer::gcode
