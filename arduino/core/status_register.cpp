#include "arduino/core/status_register.h"

#include "arduino/core/interrupts.h"
#include "arduino/core/loops.h"
#include "runtime/runtime.h"

namespace qduino::arduino {

StatusRegister::operator std::uint8_t() const {
    const auto* runtime = runtime::Runtime::current();
    return runtime && runtime->handlers_held() ? 0 : kHandlersRun;
}

StatusRegister& StatusRegister::operator=(std::uint8_t value) {
    if (value & kHandlersRun) {
        interrupts();
    } else {
        noInterrupts();
    }
    return *this;
}

}  // namespace qduino::arduino
