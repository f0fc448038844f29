#include "arduino/core/interrupts.h"

#include <optional>

#include "arduino/core/constants.h"
#include "arduino/core/diagnostics.h"
#include "runtime/port.h"

namespace qduino::arduino {

namespace {

std::optional<port::Edge> edge_of(int mode) {
    switch (mode) {
        case RISING:
        case HIGH:
            return port::Edge::rising;
        case FALLING:
        case LOW:
            return port::Edge::falling;
        case CHANGE:
            return port::Edge::both;
        default:
            return std::nullopt;
    }
}

bool attach(const char* call, int pin, void (*handler)(), int mode, Nanoseconds budget, Nanoseconds period,
            int core) {
    const auto edge = edge_of(mode);
    if (pin < 0 || pin >= board::kPinCount || !handler || !edge) {
        report_error(
            call, pin,
            make_error(ErrorCode::invalid_argument,
                       "an interrupt needs a pin below 128, a handler, and RISING, FALLING or CHANGE"));
        return false;
    }
    return succeeded(call, pin,
                     port::attach_interrupt(port::PinId{static_cast<std::uint16_t>(pin)}, *edge, handler,
                                            budget, period, core));
}

}  // namespace

bool attach_interrupt_vcpu(int pin, void (*handler)(), int mode, Nanoseconds budget, Nanoseconds period,
                           int core) {
    if (!is_budget(budget, period)) {
        report_error("attachInterruptVcpu", pin,
                     make_error(ErrorCode::invalid_argument, "0 < budget <= period"));
        return false;
    }
    return attach("attachInterruptVcpu", pin, handler, mode, budget, period, core);
}

bool interrupts_vcpu(DeviceClass device, Nanoseconds budget, Nanoseconds period, int core) {
    const int subject = static_cast<int>(device);
    if (!is_budget(budget, period)) {
        report_error("interruptsVcpu", subject,
                     make_error(ErrorCode::invalid_argument, "0 < budget <= period"));
        return false;
    }
    return succeeded("interruptsVcpu", subject,
                     port::interrupts_vcpu(static_cast<std::uint8_t>(device), budget, period, core));
}

}  // namespace qduino::arduino

namespace port = qduino::port;
using qduino::Nanoseconds;
using qduino::arduino::DeviceClass;
using qduino::arduino::succeeded;

void attachInterrupt(int interrupt, void (*handler)(), int mode) {
    qduino::arduino::attach("attachInterrupt", interrupt, handler, mode, Nanoseconds{}, Nanoseconds{},
                            qduino::runtime::kAnyCore);
}

void detachInterrupt(int interrupt) {
    if (interrupt < 0 || interrupt >= qduino::board::kPinCount) return;
    port::detach_interrupt(port::PinId{static_cast<std::uint16_t>(interrupt)});
}

void noInterrupts() { port::global_interrupts(false); }
void interrupts() { port::global_interrupts(true); }

bool noInterrupts(DeviceClass device, int core) {
    return succeeded("noInterrupts", core,
                     port::route_interrupts(static_cast<std::uint8_t>(device), core, false));
}
bool interrupts(DeviceClass device, int core) {
    return succeeded("interrupts", core,
                     port::route_interrupts(static_cast<std::uint8_t>(device), core, true));
}
bool noTimer(int core) { return succeeded("noTimer", core, port::core_timer(core, false)); }
bool reTimer(int core) { return succeeded("reTimer", core, port::core_timer(core, true)); }
