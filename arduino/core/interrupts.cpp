#include "arduino/core/interrupts.h"

#include <optional>
#include <utility>

#include "arduino/core/constants.h"
#include "arduino/core/diagnostics.h"
#include "base/fixed_vector.h"
#include "runtime/runtime.h"

namespace qduino::arduino {

namespace {

using runtime::Runtime;

/// What the program's runtime answers, or that there is none yet.
template <typename Ask>
Result<void> ask_runtime(Ask ask) {
    Runtime* const runtime = Runtime::current();
    return runtime ? ask(*runtime) : board::not_running();
}

void hold_handlers(bool held) {
    if (Runtime* const runtime = Runtime::current()) runtime->global_interrupts(!held);
}

bool route(const char* call, DeviceClass device, int core, bool allowed) {
    return succeeded(call, core, ask_runtime([&](Runtime& runtime) {
                         return runtime.route_interrupts(device, core, allowed);
                     }));
}

bool set_timer(const char* call, int core, bool enabled) {
    return succeeded(call, core,
                     ask_runtime([&](Runtime& runtime) { return runtime.core_timer(core, enabled); }));
}

bool bad_budget(const char* call, int subject) {
    return refuse(call, subject, ErrorCode::invalid_argument, "0 < budget <= period");
}

/// attachInterrupt() in the constructor of a static object: there is no runtime yet.
struct EarlyInterrupt {
    int pin;
    void (*handler)();
    int mode;
};
constinit FixedVector<EarlyInterrupt, 32> early_interrupts;

void attach_early() {
    const auto early = std::exchange(early_interrupts, {});
    for (const EarlyInterrupt& interrupt : early)
        attachInterrupt(interrupt.pin, interrupt.handler, interrupt.mode);
}

void keep_for_setup(int pin, void (*handler)(), int mode) {
    before_setup(&attach_early);
    if (!early_interrupts.try_push_back({pin, handler, mode}))
        refuse("attachInterrupt", pin, ErrorCode::unavailable,
               "32 interrupts were attached before setup(): this one is not");
}

std::optional<board::Edge> edge_of(int mode) {
    if (mode == RISING || mode == HIGH) return board::Edge::rising;
    if (mode == FALLING || mode == LOW) return board::Edge::falling;
    return mode == CHANGE ? std::optional{board::Edge::both} : std::nullopt;
}

/// The pin of an interrupt's number: 0 and 1 are those of an Uno and a Mega.
int pin_of(int interrupt) {
    if (interrupt == 0 || interrupt == 1) return interrupt + 2;
    const int first = interrupt - QDUINO_INTERRUPT_OF_PIN_0;
    return first == 0 || first == 1 ? first : interrupt;
}

bool attach(const char* call, int pin, void (*handler)(), int mode, Nanoseconds budget, Nanoseconds period,
            int core) {
    const auto edge = edge_of(mode);
    if (pin < 0 || pin >= board::kPinCount || !handler || !edge) {
        return refuse(call, pin, ErrorCode::invalid_argument,
                      "an interrupt needs a pin below 128, a handler, and RISING, FALLING or CHANGE");
    }
    return succeeded(call, pin, ask_runtime([&](Runtime& runtime) {
                         return runtime.attach_interrupt(board::PinId{static_cast<std::uint16_t>(pin)}, *edge,
                                                         handler, budget, period, core);
                     }));
}

}  // namespace

bool attach_interrupt_vcpu(int pin, void (*handler)(), int mode, Nanoseconds budget, Nanoseconds period,
                           int core) {
    if (!is_budget(budget, period)) return bad_budget("attachInterruptVcpu", pin);
    if (pin >= QDUINO_INTERRUPT_OF_PIN_0) pin = pin_of(pin);  // digitalPinToInterrupt()
    return attach("attachInterruptVcpu", pin, handler, mode, budget, period, core);
}

bool interrupts_vcpu(DeviceClass device, Nanoseconds budget, Nanoseconds period, int core) {
    const int subject = static_cast<int>(device);
    if (!is_budget(budget, period)) return bad_budget("interruptsVcpu", subject);
    return succeeded("interruptsVcpu", subject, ask_runtime([&](Runtime& runtime) {
                         return runtime.interrupts_vcpu(device, budget, period, core);
                     }));
}

}  // namespace qduino::arduino

namespace board = qduino::board;
using qduino::Nanoseconds;
using qduino::arduino::DeviceClass;

void attachInterrupt(int interrupt, void (*handler)(), int mode) {
    if (!qduino::runtime::Runtime::current()) {
        qduino::arduino::keep_for_setup(interrupt, handler, mode);
        return;
    }
    qduino::arduino::attach("attachInterrupt", qduino::arduino::pin_of(interrupt), handler, mode,
                            Nanoseconds{}, Nanoseconds{}, qduino::runtime::kAnyCore);
}

void detachInterrupt(int interrupt) {
    const int pin = qduino::arduino::pin_of(interrupt);
    if (pin < 0 || pin >= board::kPinCount) return;
    board::current().detach_edge(board::PinId{static_cast<std::uint16_t>(pin)});
}

void noInterrupts() { qduino::arduino::hold_handlers(true); }
void interrupts() { qduino::arduino::hold_handlers(false); }

bool noInterrupts(DeviceClass device, int core) {
    return qduino::arduino::route("noInterrupts", device, core, false);
}
bool interrupts(DeviceClass device, int core) {
    return qduino::arduino::route("interrupts", device, core, true);
}
bool noTimer(int core) { return qduino::arduino::set_timer("noTimer", core, false); }
bool reTimer(int core) { return qduino::arduino::set_timer("reTimer", core, true); }
