// Apart from lock.cpp: a program has this member exactly when its sketch declares critical sections
// (apps/sketch/sketch_main.cpp asks).
#include "arduino/core/lock.h"

namespace qduino::arduino {

void declare_section(Lock& lock, int loop, Nanoseconds length, const std::source_location& where) {
    lock.declaration().held_by(loop, length, where.file_name(), static_cast<int>(where.line()));
}

void declare_section(Lock& lock, void (*handler)(), Nanoseconds length, const std::source_location& where) {
    lock.declaration().held_by(handler, length, where.file_name(), static_cast<int>(where.line()));
}

}  // namespace qduino::arduino
