// Finds M112, M108 and M410 in raw bytes as they arrive, before anything is queued, parsed or
// planned.
//
// A host that stops a printer must not wait behind a buffer full of moves. So the bytes of a
// console (never those of a job's file) go through this first. Constant memory, one state; chunks
// may be cut anywhere. A code is found when the character after its number has arrived, and only as
// a line's first command: `; M112` and `M117 M112` are text.
#pragma once

#include <cstdint>
#include <span>

namespace qduino::printer::gcode {

struct EmergencyCodes {
    bool stop = false;        ///< M112
    bool break_wait = false;  ///< M108
    bool stop_moves = false;  ///< M410

    [[nodiscard]] bool any() const { return stop || break_wait || stop_moves; }
    void add(const EmergencyCodes& others) {
        stop |= others.stop;
        break_wait |= others.break_wait;
        stop_moves |= others.stop_moves;
    }
};

class EmergencyScanner {
  public:
    /// The codes found in `bytes`, together with the bytes before.
    EmergencyCodes feed(std::span<const char> bytes);

  private:
    enum class State : std::uint8_t { line_start, line_number, letter, number, rest };
    void step(char c, EmergencyCodes& found);

    State state_ = State::line_start;
    std::uint32_t number_ = 0;
};

}  // namespace qduino::printer::gcode
