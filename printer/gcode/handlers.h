// The handlers of all executed codes, private to the interpreter: handlers_motion.cpp, handlers_state.cpp,
// handlers_machine.cpp. A handler checks everything first and acts last; Interpreter::execute restores the
// modal state when it fails, and puts line and code in front of its error.
#pragma once

#include <array>
#include <span>
#include <string_view>

#include "printer/gcode/interpreter.h"
#include "printer/gcode/text.h"

namespace qduino::printer::gcode {

struct Handlers {
    using Handler = Result<void> (*)(Interpreter&, const Command&);
    struct Entry {
        char letter;
        std::uint32_t number;
        std::int32_t subcode;
        Handler handler;
    };
    static std::span<const Entry> table();
    static Handler find(const CodeInfo& code);

    // handlers_motion.cpp
    static Result<void> linear_move(Interpreter&, const Command&);
    static Result<void> arc_clockwise(Interpreter&, const Command&);
    static Result<void> arc_counterclockwise(Interpreter&, const Command&);
    static Result<void> dwell(Interpreter&, const Command&);
    static Result<void> wait_for_moves(Interpreter&, const Command&);
    static Result<void> retract(Interpreter&, const Command&);
    static Result<void> recover(Interpreter&, const Command&);
    static Result<void> home(Interpreter&, const Command&);
    static Result<void> tool(Interpreter&, const Command&);

    // handlers_state.cpp
    static Result<void> inches(Interpreter&, const Command&);
    static Result<void> millimetres(Interpreter&, const Command&);
    static Result<void> absolute(Interpreter&, const Command&);
    static Result<void> relative(Interpreter&, const Command&);
    static Result<void> absolute_extrusion(Interpreter&, const Command&);
    static Result<void> relative_extrusion(Interpreter&, const Command&);
    static Result<void> set_position(Interpreter&, const Command&);
    static Result<void> machine_coordinates(Interpreter&, const Command&);
    static Result<void> retraction_settings(Interpreter&, const Command&);
    static Result<void> recover_settings(Interpreter&, const Command&);
    static Result<void> speed_factor(Interpreter&, const Command&);
    static Result<void> flow_factor(Interpreter&, const Command&);
    static Result<void> nothing(Interpreter&, const Command&);

    // handlers_machine.cpp
    static Result<void> hot_end(Interpreter&, const Command&);
    static Result<void> hot_end_wait(Interpreter&, const Command&);
    static Result<void> bed(Interpreter&, const Command&);
    static Result<void> bed_wait(Interpreter&, const Command&);
    static Result<void> fan_on(Interpreter&, const Command&);
    static Result<void> fan_off(Interpreter&, const Command&);
    static Result<void> motors_off(Interpreter&, const Command&);
    static Result<void> axis_accelerations(Interpreter&, const Command&);
    static Result<void> axis_speeds(Interpreter&, const Command&);
    static Result<void> accelerations(Interpreter&, const Command&);
    static Result<void> instantaneous_speeds(Interpreter&, const Command&);
    static Result<void> message(Interpreter&, const Command&);
    static Result<void> echo(Interpreter&, const Command&);
    static Result<void> progress(Interpreter&, const Command&);
    static Result<void> report_temperatures(Interpreter&, const Command&);
    static Result<void> report_position(Interpreter&, const Command&);
    static Result<void> report_firmware(Interpreter&, const Command&);
    static Result<void> stop(Interpreter&, const Command&);
    static Result<void> pause(Interpreter&, const Command&);
    static Result<void> filament_change(Interpreter&, const Command&);
    static Result<void> emergency_stop(Interpreter&, const Command&);

    // What they share.
    /// The number behind `letter`; none when the letter is absent; an error when it stands alone.
    static Result<std::optional<double>> number(const Command& command, char letter);
    /// As above, and an error unless `low` ≤ value ≤ `high`. `unit` is for the error's text.
    static Result<std::optional<double>> number_within(const Command& command, char letter, double low,
                                                       double high, std::string_view unit);
    static Error outside(char letter, double value, double low, double high, std::string_view unit);
    static Result<void> arc(Interpreter&, const Command&, ArcDirection direction);
    static Result<void> heat(Interpreter&, const Command&, Heater heater, bool wait);
};

}  // namespace qduino::printer::gcode
