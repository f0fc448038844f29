// Ways in which a loop tries to take more than its budget.
#pragma once

#include <span>

#include "board/board.h"

namespace qduino::bench {

struct EscapePattern {
    const char* name;
    const char* what;            ///< a few words
    void (*run)(board::Board&);  ///< on the loop's thread; need not return
    /// As a sketch's setup(): before the loops. Null: there is none.
    void (*prepare)() = nullptr;
    bool lends = false;  ///< its priority, to a thread that is in nobody's budget
    /// Its threads are ordinary ones all along: they take what no loop wants.
    bool ordinary = false;
};

[[nodiscard]] std::span<const EscapePattern> escape_patterns();

}  // namespace qduino::bench
