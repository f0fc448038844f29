#include "printer/gcode/emergency_scanner.h"

#include "printer/gcode/text.h"

namespace qduino::printer::gcode {
namespace {

constexpr std::uint32_t kStop = 112;
constexpr std::uint32_t kBreakWait = 108;
constexpr std::uint32_t kStopMoves = 410;
constexpr std::uint32_t kNumberMax = 100'000;

}  // namespace

EmergencyCodes EmergencyScanner::feed(std::span<const char> bytes) {
    EmergencyCodes found;
    for (const char c : bytes) step(c, found);
    return found;
}

void EmergencyScanner::step(char c, EmergencyCodes& found) {
    const bool line_ends = c == '\n' || c == '\r';
    switch (state_) {
        case State::line_start:
            if (is_space(c)) return;
            if (to_upper(c) == 'M')
                state_ = State::letter;
            else if (to_upper(c) == 'N')
                state_ = State::line_number;
            else
                state_ = State::rest;
            break;
        case State::line_number:
            if (is_space(c) || is_digit(c)) return;
            state_ = to_upper(c) == 'M' ? State::letter : State::rest;
            break;
        case State::letter:
            if (is_space(c)) return;
            number_ = is_digit(c) ? static_cast<std::uint32_t>(c - '0') : 0;
            state_ = is_digit(c) ? State::number : State::rest;
            break;
        case State::number:
            if (is_digit(c)) {
                if (number_ < kNumberMax) number_ = number_ * 10 + static_cast<std::uint32_t>(c - '0');
                return;
            }
            found.stop |= number_ == kStop && c != '.';
            found.break_wait |= number_ == kBreakWait && c != '.';
            found.stop_moves |= number_ == kStopMoves && c != '.';
            state_ = State::rest;
            break;
        case State::rest:
            break;
    }
    if (line_ends) state_ = State::line_start;
}

}  // namespace qduino::printer::gcode
