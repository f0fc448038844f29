// The watchdog of avr/wdt.h.
#include "arduino/avr/wdt.h"

#include "board/board.h"
#include "runtime/runtime.h"
#include "runtime/sketch.h"

namespace qduino::arduino {
namespace {

board::VcpuId watched_loop() {
    const board::VcpuId caller = board::current().current_vcpu();
    if (caller != board::kNoVcpu) return caller;
    for (const runtime::LoopDeclaration& loop : runtime::sketch_table().loops) {
        if (loop.classic) return loop.id;
    }
    return board::kNoVcpu;
}

}  // namespace

void watch(Nanoseconds limit) {
    const board::VcpuId loop = watched_loop();
    runtime::Runtime* runtime = runtime::Runtime::current();
    if (runtime && loop != board::kNoVcpu) runtime->promise_progress(loop, limit);
}

}  // namespace qduino::arduino
