#include "printer/gcode/interpreter.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "printer/gcode/handlers.h"
#include "printer/gcode/text.h"

namespace qduino::printer::gcode {
namespace {

const AxisConfig& axis_config(const MachineConfig& machine, Axis axis) {
    return machine.axes[static_cast<std::size_t>(axis)];
}

Position home_position(const MachineConfig& machine) {
    Position home;
    for (const Axis axis : kToolAxes) home[axis] = Millimetres{axis_config(machine, axis).home_position_mm};
    return home;
}

Error at_command(const Error& error, const Command& command) {
    Error placed{error.code, "line "};
    append_integer(placed.message, static_cast<std::int64_t>(command.source.line)).append(", ");
    placed.message.append(command.name()).append(": ").append(error.message);
    return placed;
}

/// An error naming the first letter of `command` that `code` does not take, if there is one.
Result<void> check_letters(const Command& command, const CodeInfo& code) {
    std::uint32_t left = command.parameters.letters();
    for (const char letter : code.parameters) left &= ~Parameters::bit(letter);
    if (left == 0) return {};
    FixedString<236> text{"this code takes no "};
    text.push_back(static_cast<char>('A' + std::countr_zero(left))).append(" here, only ");
    text.append(code.parameters.empty() ? "itself" : code.parameters);
    return make_error(ErrorCode::invalid_argument, text);
}

Error outside_bounds(Axis axis, Millimetres target, const AxisConfig& config) {
    FixedString<236> text;
    text.push_back(kAxisLetter[static_cast<std::size_t>(axis)]).append(" would go to ");
    append_shortest(text, target.value()).append(" mm; this machine reaches from ");
    append_shortest(text, config.minimum_mm).append(" to ");
    append_shortest(text, config.maximum_mm).append(" mm");
    return make_error(ErrorCode::out_of_range, text);
}

}  // namespace

Interpreter::Interpreter(const MachineConfig& machine, Actions& actions)
    : config_(machine), actions_(actions) {
    state_.machine = home_position(machine);
}

Result<void> Interpreter::execute(const Command& command, std::size_t moves_max) {
    QDUINO_EXPECT(!pending() && moves_max > 0);
    source_ = command.source;
    const Result<void> done = dispatch(command, moves_max);
    return done ? done : Result<void>{at_command(done.error(), command)};
}

Result<void> Interpreter::dispatch(const Command& command, std::size_t moves_max) {
    const CodeInfo* const code = find_code(command);
    if (code == nullptr || code->status == CodeStatus::acknowledged) {
        skip(command, code);
        return {};
    }
    if (code->strictness == Strictness::strict) {
        if (auto letters = check_letters(command, *code); !letters) return letters;
    }
    const ModalState before = state_;
    Result<void> done = Handlers::find(*code)(*this, command);
    if (done && pending()) done = proceed(moves_max);
    if (!done) {
        const bool moved = !(state_.machine == before.machine);
        if (!moved) state_ = before;
    }
    return done;
}

Result<void> Interpreter::proceed(std::size_t moves_max) {
    for (std::size_t made = 0; arc_ && made < moves_max; ++made) {
        Position point = arc_->peek();
        Result<void> moved =
            check_target(point);  // it was inside when the arc began; this puts it onto the bound
        if (moved) moved = emit(point, state_.feedrate);
        if (!moved) {
            state_.programmed_e -= (arc_->end()[Axis::e] - state_.machine[Axis::e]) / state_.flow_factor;
            arc_.reset();
            return moved;
        }
        arc_->advance();
        if (arc_->done()) arc_.reset();
    }
    return {};
}

Result<void> Interpreter::emit(const Position& target, MillimetresPerSecond feedrate, bool firmware_retract) {
    if (target == state_.machine) return {};
    Move move;
    move.from = state_.machine;
    move.to = target;
    move.feedrate = std::clamp(feedrate * state_.speed_factor, kSlowest, kFastest);
    move.firmware_retract = firmware_retract;
    move.source = source_;
    const bool tool_moves = std::any_of(kToolAxes.begin(), kToolAxes.end(),
                                        [&](Axis axis) { return move.from[axis] != move.to[axis]; });
    if (!tool_moves) {
        move.kind = MoveKind::filament;
    } else {
        move.kind = move.from[Axis::e] == move.to[Axis::e] ? MoveKind::travel : MoveKind::print;
    }
    warn_unhomed(target);
    auto accepted = actions_.move(move);
    if (accepted) state_.machine = target;
    return accepted;
}

Result<void> Interpreter::check_target(Position& target) const {
    for (const Axis axis : kToolAxes) {
        if (target[axis] == state_.machine[axis]) continue;  // an axis that stands still breaks no bound
        const AxisConfig& config = axis_config(config_, axis);
        const Millimetres low{config.minimum_mm};
        const Millimetres high{config.maximum_mm};
        const bool inside = target[axis] >= low - kBoundsTolerance && target[axis] <= high + kBoundsTolerance;
        if (!inside) return outside_bounds(axis, target[axis], config);
        target[axis] = std::clamp(target[axis], low, high);
    }
    const double extruded_mm = (target[Axis::e] - state_.machine[Axis::e]).value();
    if (!(std::abs(extruded_mm) <= kLongestExtrusion.value())) {
        return Handlers::outside('E', extruded_mm, -kLongestExtrusion.value(), kLongestExtrusion.value(),
                                 "mm in one move (is a G92 E0 missing?)");
    }
    return {};
}

void Interpreter::warn(std::string_view text) {
    ++warnings_;
    actions_.note(NoteKind::warning, text, source_);
}

void Interpreter::warn_unhomed(const Position& target) {
    for (const Axis axis : kToolAxes) {
        const auto index = static_cast<std::size_t>(axis);
        if (state_.homed[index] || state_.warned_unhomed[index] || target[axis] == state_.machine[axis])
            continue;
        state_.warned_unhomed[index] = true;
        FixedString<128> text;
        text.push_back(kAxisLetter[index])
            .append(" moves without having been homed (G28): its place is assumed");
        warn(text);
    }
}

void Interpreter::skip(const Command& command, const CodeInfo* code) {
    FixedString<160> text;
    if (code == nullptr) {
        ++unknown_codes_;
        text.append("Unknown command: \"").append(command.name()).append("\"");
        actions_.note(NoteKind::unknown_code, text, source_);
        return;
    }
    ++codes_not_done_;
    text.append(command.name())
        .append(" (")
        .append(code->name)
        .append(") is known but not yet done: skipped");
    actions_.note(NoteKind::not_done, text, source_);
}

void Interpreter::set_position(const Position& machine) {
    arc_.reset();
    state_.machine = machine;
}

void Interpreter::set_homed(Axis axis, bool homed) {
    QDUINO_EXPECT(axis != Axis::e);
    state_.homed[static_cast<std::size_t>(axis)] = homed;
    state_.warned_unhomed[static_cast<std::size_t>(axis)] = false;
}

void Interpreter::adopt_factors(const ModalState& from) {
    state_.speed_factor = from.speed_factor;
    state_.speed_factor_kept = from.speed_factor_kept;
    state_.flow_factor = from.flow_factor;
}

void Interpreter::reset_modes() {
    ModalState fresh;
    fresh.machine = state_.machine;
    fresh.homed = state_.homed;
    state_ = fresh;
    arc_.reset();
    unknown_codes_ = codes_not_done_ = warnings_ = 0;
}

Position Interpreter::programmed_position() const {
    Position programmed;
    for (const Axis axis : kToolAxes) programmed[axis] = state_.machine[axis] - state_.offset[axis];
    programmed[Axis::e] = state_.programmed_e;
    return programmed;
}

bool Interpreter::has_handler(const CodeInfo& code) { return Handlers::find(code) != nullptr; }

}  // namespace qduino::printer::gcode
