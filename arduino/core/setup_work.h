// Background work while setup() waits: no loop runs yet that could do it.
#pragma once

#include "base/time.h"

namespace qduino::arduino {

/// Called by delay() in setup() with the instant until which it waits; may return before it. Static
/// initialisers only.
void set_setup_work(void (*work)(Instant until));

}  // namespace qduino::arduino
