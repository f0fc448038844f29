// Apart from lock.cpp: a program has this member exactly when its sketch declares critical sections
// (apps/host/sketch_main.cpp asks).
#include "arduino/core/lock.h"

namespace qduino::arduino {

void declare_section(runtime::LockDeclaration& lock, board::VcpuId loop, Nanoseconds length) {
    lock.held_by(loop, length);
}

}  // namespace qduino::arduino
