// Commands to actions: the modal state of G-code, and one small handler for every code.
//
//   G20 G21           units of length            F            modal speed
//   G90 G91 M82 M83   absolute or relative       M220 M221    factors of speed and flow
//   G92               where zero is              G10 G11      retraction
//
//   … all of it lives in ModalState, and nowhere else.
//
// Here, and in no other place, a speed is mm/min (it is divided by 60 at once), a length may be inches, and
// a coordinate may be relative.
//
// Invariants
// - A command that fails changes nothing: not the modal state, not the position. Its error names the line,
//   the code, what is wrong and which limit it breaks. (An arc or a G10 that the machine refuses half-way
//   stands where it was refused.)
// - Every move that is handed on is finite and inside the machine's bounds, for X, Y, Z from AxisConfig.
// - An unknown code is noted and skipped; it never fails.
//
// Semantics follow Marlin (marlinfw.org/meta/gcode) where slicers rely on it: G90/G91 set E's mode as well,
// M82/M83 set E's alone; G92 without axes zeroes all; G28 takes the axes it homes out of G92's offset.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>

#include "base/quantity.h"
#include "base/result.h"
#include "printer/gcode/actions.h"
#include "printer/gcode/arc.h"
#include "printer/gcode/command.h"
#include "printer/gcode/command_table.h"
#include "printer/gcode/position.h"
#include "printer/machine_config.h"

namespace qduino::printer::gcode {

/// The largest target of a heater is this far below the reading that is a fault.
inline constexpr double kTargetMarginCelsius = 15;
/// A coordinate may be this far outside of the bounds by rounding (inch files); it is then put onto the
/// bound.
inline constexpr Millimetres kBoundsTolerance{0.001};
/// Speeds are kept between these, so that the time of every move stays a sane number. The machine's own
/// limits are far inside.
inline constexpr MillimetresPerSecond kSlowest{0.001};
inline constexpr MillimetresPerSecond kFastest{100'000};
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
    double unit_mm = 1;       ///< millimetres in a unit of length: 1, or 25.4 after G20
    bool relative = false;    ///< G91: X, Y, Z
    bool relative_e = false;  ///< M83, or G91
    MillimetresPerSecond feedrate{25};
    double speed_factor = 1;       ///< M220
    double speed_factor_kept = 1;  ///< M220 B keeps, M220 R restores
    double flow_factor = 1;        ///< M221
    Position machine;              ///< where the last accepted move ends
    Position offset;               ///< machine = programmed + offset, for X, Y, Z
    Millimetres programmed_e;      ///< E as G-code counts it; G92 sets it, flow does not scale it
    std::array<bool, 3> homed{};
    std::array<bool, 3> warned_unhomed{};
    RetractionSettings retraction{};
    bool retracted = false;
    Millimetres retracted_length;  ///< by the G10 in force
    Millimetres lifted;            ///< likewise; part of Z's offset
};

class Interpreter {
  public:
    static constexpr std::size_t kAllMoves = std::numeric_limits<std::size_t>::max();

    /// Both must outlive the interpreter. The tool is taken to stand at the home position until told
    /// otherwise.
    Interpreter(const MachineConfig& machine, Actions& actions);

    /// Carries out one command. Of an arc at most `moves_max` (1 or more) moves are handed on and the rest
    /// stays pending; G10 and G11 make up to two moves, every other command at most one. Contract: nothing
    /// is pending.
    Result<void> execute(const Command& command, std::size_t moves_max = kAllMoves);

    /// An arc has pieces left: proceed() must empty it before the next command.
    [[nodiscard]] bool pending() const { return arc_.has_value(); }
    /// Hands on up to `moves_max` pieces of the pending arc. After an error nothing is pending.
    Result<void> proceed(std::size_t moves_max = kAllMoves);

    /// The machine stands somewhere else than the moves said: after a cancelled job, a failed homing. Drops
    /// a pending arc. X, Y, Z keep G92's offset; E keeps its programmed value.
    void set_position(const Position& machine);
    /// Homed or not, by an event outside of G-code (a motor switched off, a fault).
    void set_homed(Axis axis, bool homed);
    /// Takes M220's and M221's factors over from another interpreter.
    void adopt_factors(const ModalState& from);
    /// To the state at start (modes, offsets, factors, retraction); position and homing stay. For the next
    /// job.
    void reset_modes();

    [[nodiscard]] const ModalState& state() const { return state_; }
    /// What M114 says: the position as the program counts it, in millimetres.
    [[nodiscard]] Position programmed_position() const;
    [[nodiscard]] bool homed(Axis axis) const { return state_.homed[static_cast<std::size_t>(axis)]; }

    // Counted since construction or reset_modes().
    [[nodiscard]] std::uint32_t unknown_codes() const { return unknown_codes_; }
    [[nodiscard]] std::uint32_t codes_not_done() const { return codes_not_done_; }
    [[nodiscard]] std::uint32_t warnings() const { return warnings_; }

    /// True if this code has a handler. The table (command_table.h) says `executed` for exactly these; a
    /// test checks it.
    static bool has_handler(const CodeInfo& code);

  private:
    friend struct Handlers;  // handlers.h: one static function for every code

    Result<void> dispatch(const Command& command, std::size_t moves_max);
    Result<void> emit(const Position& target, MillimetresPerSecond feedrate, bool firmware_retract = false);
    /// Bounds and extrusion length; puts a rounding error onto the bound.
    Result<void> check_target(Position& target) const;
    void warn(std::string_view text);
    void warn_unhomed(const Position& target);
    void skip(const Command& command, const CodeInfo* code);

    MachineConfig config_;
    Actions& actions_;
    ModalState state_;
    Source source_{};  ///< of the command in hand
    std::optional<ArcPath> arc_{};
    std::uint32_t unknown_codes_ = 0;
    std::uint32_t codes_not_done_ = 0;
    std::uint32_t warnings_ = 0;
};

}  // namespace qduino::printer::gcode
