// Ways in which a loop tries to take more than its budget.
#pragma once

#include <span>

#include "board/board.h"

namespace qduino::bench {

struct EscapePattern {
    const char* name;
    const char* what;            ///< a few words
    void (*run)(board::Board&);  ///< on the loop's thread; need not return
    /// As a sketch's setup(): in the program, before the board. Null: there is none.
    void (*prepare)() = nullptr;
    bool lends = false;  ///< its priority, to a thread that is in nobody's budget
};

[[nodiscard]] std::span<const EscapePattern> escape_patterns();

}  // namespace qduino::bench
