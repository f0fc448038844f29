// Apart from lock.cpp: a program has this member exactly when its sketch may begin a bus that loops
// share (apps/sketch/sketch_main.cpp asks).
#include "arduino/core/lock.h"

namespace qduino::arduino {

void declare_use(Lock& lock) { lock.declaration().use(); }

}  // namespace qduino::arduino
