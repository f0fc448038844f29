// yield() is a hook: a sketch may have one of its own, which delay() calls while it waits.
#pragma once

namespace qduino::arduino {
/// The linker took the yield() of a sketch, and not the board's.
[[nodiscard]] bool sketch_has_yield();
}  // namespace qduino::arduino
