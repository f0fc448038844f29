#include "printer/machine/console.h"

#include "printer/gcode/command_table.h"
#include "printer/gcode/parser.h"
#include "printer/machine/motion_pipe.h"

namespace qduino::printer::machine {

Result<void> Console::may_type(const gcode::Command& command, const Situation& now) {
    using gcode::Typed;
    const Typed needed = now.faulted      ? Typed::always
                         : !now.job_runs  ? Typed::at_rest
                         : now.head_rests ? Typed::parked
                                          : Typed::printing;
    if (gcode::may_be_typed(command) >= needed) return {};
    return make_error(ErrorCode::unavailable, command.name(), " was not done: ",
                      now.faulted ? "the machine has a fault; clear it first"
                                  : "a job runs; only temperatures, fan, M220, M221 and questions are taken, "
                                    "and while it is paused jogs");
}

Result<void> Console::take(std::string_view line) {
    if (line.size() > gcode::kCommandBytesMax)
        return make_error(ErrorCode::invalid_argument, "the line is longer than 256 bytes: it was not taken");
    if (lines_.try_push_back(line)) return {};
    return make_error(ErrorCode::unavailable,
                      "busy: sixteen lines are waiting already; try again when they are done");
}

std::optional<Result<void>> Console::run_next(const Situation& now, gcode::Interpreter& interpreter) {
    QDUINO_EXPECT(waiting());
    const FixedString<gcode::kCommandBytesMax> text = lines_.front();
    lines_.erase(0);
    const Result<std::optional<gcode::Command>> parsed = gcode::parse_line(text);
    if (!parsed.ok()) return Result<void>{parsed.error()};
    if (!parsed->has_value()) return std::nullopt;
    if (const Result<void> may = may_type(**parsed, now); !may.ok()) return may;
    return interpreter.execute(**parsed, kArcPiecesAtOnce);
}

}  // namespace qduino::printer::machine
