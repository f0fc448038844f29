#include "printer/machine/console.h"

#include <utility>

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

Result<void> Console::take(std::string_view line, Speaker speaker) {
    if (line.size() > gcode::kCommandBytesMax)
        return make_error(ErrorCode::invalid_argument, "the line is longer than 256 bytes: it was not taken");
    const bool of_host = speaker == Speaker::host;
    if (held_for(speaker) >= (of_host ? link::kHostLinesMax : kLinesMax) || count_ == entries_.size()) {
        return make_error(ErrorCode::unavailable, "busy: ",
                          of_host ? "more lines are waiting than a host may send"
                                  : "sixteen lines are waiting already; try again when they are done");
    }
    entries_[(first_ + count_) % entries_.size()] = {FixedString<gcode::kCommandBytesMax>{line}, speaker};
    // What a host sends waits for the motion. A person goes before it.
    for (std::size_t i = count_; i > 0 && !of_host; --i) {
        Entry& before = entries_[(first_ + i - 1) % entries_.size()];
        if (before.speaker != Speaker::host) break;
        std::swap(before, entries_[(first_ + i) % entries_.size()]);
    }
    ++count_;
    if (of_host && !line.empty()) ++of_host_;
    return {};
}

/// Nothing: the next line holds none.
std::optional<gcode::Command> Console::command() const {
    Result<std::optional<gcode::Command>> parsed = gcode::parse_line(next().line);
    return parsed.ok() ? *parsed : std::nullopt;
}

gcode::Ok Console::ok() const {
    const auto next_command = command();
    return next_command ? gcode::ok_of(*next_command) : gcode::Ok::when_done;
}

bool Console::waits_for_nothing(bool acts) const {
    const auto next_command = command();
    if (!next_command) return false;
    const gcode::Typed typed = gcode::may_be_typed(*next_command);
    return typed == gcode::Typed::always ||
           (acts && typed == gcode::Typed::printing && speaker() == Speaker::person);
}

bool Console::waits_for_line() const {
    const auto next_command = command();
    return next_command &&
           (next_command->word.view() == "EXCLUDE_OBJECT" ||
            (next_command->letter == 'M' && (next_command->number == 486 || next_command->number == 221)));
}

std::size_t Console::forget() {
    const std::size_t of_host = of_host_;
    count_ = of_host_ = 0;
    return of_host;
}

std::optional<Result<void>> Console::run_next(const Situation& now, gcode::Interpreter& interpreter) {
    const Entry entry = next();
    first_ = (first_ + 1) % entries_.size();
    --count_;
    if (entry.speaker == Speaker::host && !entry.line.empty()) --of_host_;
    const Result<std::optional<gcode::Command>> parsed = gcode::parse_line(entry.line);
    if (!parsed.ok()) return Result<void>{parsed.error()};
    if (!parsed->has_value()) return std::nullopt;
    if (const Result<void> may = may_type(**parsed, now); !may.ok()) return may;
    return interpreter.pending() ? interpreter.execute_beside(**parsed)
                                 : interpreter.execute(**parsed, kArcPiecesAtOnce);
}

}  // namespace qduino::printer::machine
