#include "printer/gcode/interpreter.h"

#include <algorithm>
#include <bit>
#include <numbers>
#include <utility>

#include "printer/gcode/dialect.h"
#include "printer/gcode/parser.h"

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

/// Sets the numbers that a state which begins anew has from the machine.
void set_defaults(ModalState& state, const MachineConfig& machine) {
    const double diameter_mm = machine.filament_diameter.value();
    state.filament_area_mm2 = std::numbers::pi / 4 * diameter_mm * diameter_mm;
    state.minimum_extrude = machine.minimum_extrude;
}

}  // namespace

Interpreter::Interpreter(const MachineConfig& machine, Actions& actions)
    : context_{.config = machine, .actions = actions} {
    context_.state.machine = home_positions(machine);
    context_.state.skew = machine.skew;
    set_defaults(context_.state, machine);
    context_.state.dialect = machine.dialect.value_or(Dialect::marlin);
}

Result<void> Interpreter::heed(const Line& line) {
    ModalState& state = context_.state;
    const Dialect said =
        line.command != nullptr ? dialect_of(*line.command) : dialect_of_comment(line.comment);
    if (said <= state.dialect || context_.config.dialect) return {};
    state.dialect = said;
    context_.dialect_line = line.source.line;
    // What M82 or M83 said last counts again, whatever a G90 or G91 made of it.
    state.relative_e = state.said_relative_e;
    const std::uint64_t disputed = context_.e_disputed;
    if (disputed == 0) return {};
    return make_error(ErrorCode::invalid_argument, "line ", line.source.line, ": this file is ",
                      name_of(said), "'s, where G90 and G91 leave E alone; the E of line ", disputed,
                      " was read as Marlin would: write M82 or M83 before that line");
}

Result<void> Interpreter::execute(const Command& command, std::size_t moves_max) {
    QDUINO_EXPECT(!pending() && moves_max > 0);
    context_.source = command.source;
    const Result<void> done = dispatch(command, moves_max);
    if (!done) return at_command(done.error(), command);
    return moves_max == kAllMoves && pending() ? proceed() : done;
}

Result<void> Interpreter::dispatch(const Command& command, std::size_t moves_max) {
    if (command.letter == '\0') {
        if (const Macro* const macro = find_macro(context_.config, command.word.view()))
            return expand(command, *macro);
    }
    const CodeInfo* const code = find_code(command);
    if (code == nullptr || code->handler == nullptr) return skip(command, code);
    if (code->strictness == Strictness::strict) QDUINO_TRY(check_letters(command, *code));
    const ModalState before = context_.state;
    const bool waited = context_.left_at.has_value();
    Result<void> done = code->handler(context_, command);
    if (done && context_.curve) done = proceed_on_curve(moves_max);
    if (!done && waited) context_.wait_on(before);
    const bool moved = context_.state.machine != before.machine;
    if (!done && !moved) context_.state = before;
    return std::exchange(context_.not_done, false) ? skip(command, code) : done;
}

Result<void> Interpreter::execute_beside(const Command& command) {
    QDUINO_EXPECT(may_be_typed(command) >= Typed::printing);
    const Source in_hand = std::exchange(context_.source, command.source);
    const CodeInfo* const code = find_code(command);
    const ModalState before = context_.state;
    Result<void> done =
        code == nullptr || code->handler == nullptr ? skip(command, code) : code->handler(context_, command);
    if (!done) {
        context_.state = before;
        done = at_command(done.error(), command);
    }
    context_.source = in_hand;
    return done;
}

Result<void> Interpreter::expand(const Command& command, const Macro& macro) {
    if (in_lines_) return make_error(ErrorCode::unsupported, "a macro of the machine file calls no macro");
    return context_.lines.begin(macro.name.view(), macro.text.view(), command.text.view());
}

Result<void> Interpreter::proceed(std::size_t moves_max) {
    do {
        QDUINO_TRY(context_.curve ? proceed_on_curve(moves_max) : proceed_with_lines(moves_max));
    } while (moves_max == kAllMoves && pending());
    return {};
}

Result<void> Interpreter::proceed_on_curve(std::size_t moves_max) {
    for (std::size_t made = 0; context_.curve && made < moves_max; ++made) {
        Position point = context_.curve->peek();
        // It was inside when the curve began; this puts it onto the bound.
        Result<void> moved = context_.check_target(point);
        if (moved) moved = context_.move_to(point, context_.state.feedrate);
        if (!moved) {
            ModalState& state = context_.state;
            const Millimetres left = context_.curve->end()[Axis::e] - state.machine[Axis::e];
            state.programmed_e -= left / state.filament_factor();
            context_.curve.reset();
            context_.lines.clear();
            return moved;
        }
        context_.curve->advance();
        if (context_.curve->done()) context_.curve.reset();
    }
    return {};
}

/// The next line of a macro.
Result<void> Interpreter::proceed_with_lines(std::size_t moves_max) {
    if (!context_.lines.active()) return {};
    const auto fail = [this](const Error& error) {
        context_.lines.clear();
        return make_error(error.code, "line ", context_.source.line, ", ", context_.lines.name(), ": ",
                          error.message);
    };
    Result<std::optional<Command>> parsed = parse_line(context_.lines.next());
    if (!parsed) return fail(parsed.error());
    if (!*parsed) return {};
    (*parsed)->source = context_.source;
    in_lines_ = true;
    const Result<void> done = dispatch(**parsed, moves_max);
    in_lines_ = false;
    if (done) return done;
    return fail(make_error(done.error().code, (*parsed)->name(), ": ", done.error().message));
}

Result<void> Interpreter::skip(const Command& command, const CodeInfo* code) {
    if (code == nullptr && may_move(command))
        return make_error(ErrorCode::not_found, "this printer has no such ",
                          command.letter == '\0' ? "command" : "G-code", ", and it may move");
    if (code == nullptr) {
        ++unknown_codes_;
        context_.actions.note(NoteKind::unknown_code, text("Unknown command: \"", command.name(), '"'),
                              context_.source);
        return {};
    }
    ++codes_not_done_;
    context_.actions.note(NoteKind::not_done,
                          text(command.name(), " (", code->name, ") is not done by this printer: skipped"),
                          context_.source);
    return {};
}

Result<void> Interpreter::finish() {
    QDUINO_EXPECT(!pending());
    const Result<void> done = context_.settle();
    if (done) return done;
    return make_error(done.error().code, "the end of the job: ", done.error().message);
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
    fresh.skew = context_.state.skew;
    fresh.filament_peak = fresh.machine[Axis::e];
    set_defaults(fresh, context_.config);
    fresh.dialect = context_.config.dialect.value_or(Dialect::marlin);
    context_.state = fresh;
    context_.dialect_line = 0;
    context_.said_how_e_counts = false;
    context_.e_disputed = 0;
    context_.curve.reset();
    context_.lines.clear();
    context_.left_at.reset();
    context_.objects.reset();
    context_.saved.clear();
    context_.program_ended = false;
    unknown_codes_ = codes_not_done_ = context_.warnings = 0;
}

Position Interpreter::programmed_position() const {
    return programmed_position(context_.state.machine, Millimetres{0});
}

Position Interpreter::programmed_position(const Position& machine, Millimetres behind) const {
    Position programmed;
    const ModalState& state = context_.state;
    for (const Axis axis : kToolAxes) programmed[axis] = machine[axis] - state.offset[axis];
    programmed[Axis::e] = state.programmed_e - behind / state.filament_factor();
    return programmed;
}

}  // namespace qduino::printer::gcode
