#include "printer/gcode/interpreter.h"

#include <bit>

namespace qduino::printer::gcode {
namespace {

Error at_command(const Error& error, const Command& command) {
    return make_error(error.code, "line ", command.source.line, ", ", command.name(), ": ", error.message);
}

/// An error naming the first letter of `command` that `code` does not take, if there is one.
Result<void> check_letters(const Command& command, const CodeInfo& code) {
    std::uint32_t left = command.parameters.letters();
    for (const char letter : code.parameters) left &= ~Parameters::bit(letter);
    if (left == 0) return {};
    return make_error(ErrorCode::invalid_argument, "this code takes no ",
                      static_cast<char>('A' + std::countr_zero(left)), " here, only ",
                      code.parameters.empty() ? "itself" : code.parameters);
}

}  // namespace

Interpreter::Interpreter(const MachineConfig& machine, Actions& actions)
    : context_{.config = machine, .actions = actions} {
    context_.state.machine = home_positions(machine);
}

Result<void> Interpreter::execute(const Command& command, std::size_t moves_max) {
    QDUINO_EXPECT(!pending() && moves_max > 0);
    context_.source = command.source;
    const Result<void> done = dispatch(command, moves_max);
    return done ? done : Result<void>{at_command(done.error(), command)};
}

Result<void> Interpreter::dispatch(const Command& command, std::size_t moves_max) {
    const CodeInfo* const code = find_code(command);
    if (code == nullptr || code->handler == nullptr) {
        skip(command, code);
        return {};
    }
    if (code->strictness == Strictness::strict) QDUINO_TRY(check_letters(command, *code));
    const ModalState before = context_.state;
    Result<void> done = code->handler(context_, command);
    if (done && pending()) done = proceed(moves_max);
    const bool moved = context_.state.machine != before.machine;
    if (!done && !moved) context_.state = before;
    return done;
}

Result<void> Interpreter::proceed(std::size_t moves_max) {
    for (std::size_t made = 0; context_.arc && made < moves_max; ++made) {
        Position point = context_.arc->peek();
        // It was inside when the arc began; this puts it onto the bound.
        Result<void> moved = context_.check_target(point);
        if (moved) moved = context_.move_to(point, context_.state.feedrate);
        if (!moved) {
            ModalState& state = context_.state;
            state.programmed_e -= (context_.arc->end()[Axis::e] - state.machine[Axis::e]) / state.flow_factor;
            context_.arc.reset();
            return moved;
        }
        context_.arc->advance();
        if (context_.arc->done()) context_.arc.reset();
    }
    return {};
}

void Interpreter::skip(const Command& command, const CodeInfo* code) {
    if (code == nullptr) {
        ++unknown_codes_;
        return context_.actions.note(NoteKind::unknown_code, text("Unknown command: \"", command.name(), '"'),
                                     context_.source);
    }
    ++codes_not_done_;
    context_.actions.note(NoteKind::not_done,
                          text(command.name(), " (", code->name, ") is known but not yet done: skipped"),
                          context_.source);
}

void Interpreter::adopt_factors(const ModalState& from) {
    context_.state.speed_factor = from.speed_factor;
    context_.state.speed_factor_kept = from.speed_factor_kept;
    context_.state.flow_factor = from.flow_factor;
}

void Interpreter::reset_modes() {
    ModalState fresh;
    fresh.machine = context_.state.machine;
    fresh.homed = context_.state.homed;
    context_.state = fresh;
    context_.arc.reset();
    unknown_codes_ = codes_not_done_ = context_.warnings = 0;
}

Position Interpreter::programmed_position() const {
    Position programmed;
    const ModalState& state = context_.state;
    for (const Axis axis : kToolAxes) programmed[axis] = state.machine[axis] - state.offset[axis];
    programmed[Axis::e] = state.programmed_e;
    return programmed;
}

}  // namespace qduino::printer::gcode
