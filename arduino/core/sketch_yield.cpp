#include "arduino/core/sketch_yield.h"

#include "arduino/core/wiring.h"
#include "runtime/runtime.h"

extern "C" {
void qduino_yield(void) {
    if (auto* runtime = qduino::runtime::Runtime::current()) runtime->yield();
}
[[gnu::weak, gnu::alias("qduino_yield")]] void yield(void);
}

bool qduino::arduino::sketch_has_yield() {
    // Through a variable: to the compiler the two are one here, and the linker may not agree.
    void (*volatile const called)() = &yield;
    return called != &qduino_yield;
}
