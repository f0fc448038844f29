// Ways in which a loop tries to take more than its budget.
#pragma once

#include <span>

#include "board/board.h"

namespace qduino::bench {

struct EscapePattern {
    const char* name;
    const char* what;            ///< a few words
    void (*run)(board::Board&);  ///< on the loop's thread; need not return
};

[[nodiscard]] std::span<const EscapePattern> escape_patterns();

/// For the pattern that stops its own process: a helper that wakes it. In the program, before the
/// board.
void start_waker();

}  // namespace qduino::bench
