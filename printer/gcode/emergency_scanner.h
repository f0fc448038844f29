// Finds M112, M108 and M410 in raw bytes as they arrive, before anything is queued, parsed or planned.
//
// A host that stops a printer must not wait behind a buffer full of moves, so whoever receives bytes from a
// serial host (never from a job's file) is to run this over them first. No program has one yet. Constant memory,
// one state; chunks may be cut anywhere. It acts when the character after the number has arrived, and only on a line's first
// command: `; M112` and `M117 M112` are text.
#pragma once

#include <cstdint>
#include <span>

namespace qduino::printer::gcode {

struct EmergencyCodes {
    bool stop = false;        ///< M112
    bool break_wait = false;  ///< M108
    bool stop_moves = false;  ///< M410
};

class EmergencyScanner {
  public:
    /// What was found in `bytes`, together with those before.
    EmergencyCodes feed(std::span<const char> bytes);

  private:
    enum class State : std::uint8_t { line_start, line_number, letter, number, rest };
    void step(char c, EmergencyCodes& found);

    State state_ = State::line_start;
    std::uint32_t number_ = 0;
};

}  // namespace qduino::printer::gcode
