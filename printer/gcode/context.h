// The handlers of the G-codes work on this: the modal state, the machine's numbers, the way out to
// the machine.
//
//   G20 G21           units of length            F            modal speed
//   G90 G91 M82 M83   absolute or relative       M220 M221    factors of speed and flow
//   G92               where zero is              G10 G11      retraction
//
// All of it lives in ModalState, and nowhere else.
//
// For handlers and the interpreter alone. Their bodies: handlers_motion.cpp, handlers_state.cpp,
// handlers_machine.cpp.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "base/quantity.h"
#include "base/result.h"
#include "printer/gcode/actions.h"
#include "printer/gcode/arc.h"
#include "printer/gcode/command_table.h"
#include "printer/gcode/position.h"
#include "printer/machine_config.h"

namespace qduino::printer::gcode {

/// A coordinate may be this far outside of the bounds by rounding (inch files); it is then put onto
/// the bound.
inline constexpr Millimetres kBoundsTolerance{0.001};
/// Speeds are kept between these, so that the time of every move stays a sane number. The machine's
/// own limits are far inside.
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
    PerAxis<bool> homed{};         ///< X, Y, Z
    PerAxis<bool> warned_unhomed{};
    RetractionSettings retraction{};
    bool retracted = false;
    Millimetres retracted_length;  ///< by the G10 in force
    Millimetres lifted;            ///< likewise; part of Z's offset

    void set_homed(Axis axis, bool is_homed) {
        homed[axis] = is_homed;
        warned_unhomed[axis] = false;
    }
};

struct Context {
    MachineConfig config;
    Actions& actions;
    ModalState state{};
    Source source{};               ///< of the command in hand
    std::optional<ArcPath> arc{};  ///< begun; the interpreter hands its chords on
    std::uint32_t warnings = 0;

    /// Hands on a straight line from `state.machine` to `target`, at `feedrate` and M220; none when
    /// it has no length. `target` has been checked.
    Result<void> move_to(const Position& target, MillimetresPerSecond feedrate,
                         bool firmware_retract = false);
    /// Error: out of the machine's bounds, or too much filament. Puts a rounding error onto the
    /// bound.
    Result<void> check_target(Position& target) const;
    void warn(std::string_view text);

  private:
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
/// The axes whose letters stand in the command; `otherwise` when none does.
AxisSet axes_of(const Command& command, AxisSet otherwise);

}  // namespace qduino::printer::gcode
