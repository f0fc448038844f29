// The macros of the language. Included last: none of our headers uses these words after it.
//
// A macro named loop would break libraries that have a method of that name. So such a macro chooses
// by the number of its arguments: `client.loop()` and `loop(void)` stay calls and declarations, and
// three to six arguments declare a VCPU. A library with a method loop(a, b, c) must `#undef loop`
// around it.
#pragma once

#include "arduino/core/bits.h"
#include "arduino/core/loops.h"
#include "arduino/core/numbers.h"

// ---- loop(id, budget, period [, core [, sleep [, sleeps]]]) -------------------------------------
#define QDUINO_SELECT(a0, a1, a2, a3, a4, a5, a6, chosen, ...) chosen
#define loop(...)                                                                                        \
    QDUINO_SELECT(__VA_ARGS__ __VA_OPT__(, ) QDUINO_PLAIN_LOOP, QDUINO_LOOP_THAT_SLEEPS_OFTEN,           \
                  QDUINO_LOOP_THAT_SLEEPS, QDUINO_LOOP_ON_CORE, QDUINO_LOOP_ANYWHERE, QDUINO_PLAIN_LOOP, \
                  QDUINO_PLAIN_LOOP, QDUINO_PLAIN_LOOP, unused)                                          \
    (__VA_ARGS__)
#define QDUINO_PLAIN_LOOP(...) loop(__VA_ARGS__)
#define QDUINO_LOOP_ANYWHERE(id, budget, period) \
    QDUINO_DECLARE_LOOP(__COUNTER__, id, budget, period, ::qduino::runtime::kAnyCore, 0, 0)
#define QDUINO_LOOP_ON_CORE(id, budget, period, core) \
    QDUINO_DECLARE_LOOP(__COUNTER__, id, budget, period, core, 0, 0)
#define QDUINO_LOOP_THAT_SLEEPS(id, budget, period, core, sleep) \
    QDUINO_DECLARE_LOOP(__COUNTER__, id, budget, period, core, sleep, 0)
#define QDUINO_LOOP_THAT_SLEEPS_OFTEN(id, budget, period, core, sleep, sleeps) \
    QDUINO_DECLARE_LOOP(__COUNTER__, id, budget, period, core, sleep, sleeps)
#define QDUINO_DECLARE_LOOP(...) QDUINO_DECLARE_LOOP_NUMBERED(__VA_ARGS__)
#define QDUINO_DECLARE_LOOP_NUMBERED(n, id, budget, period, core, sleep, sleeps)                             \
    static qduino_loop_body_##n();                                                                           \
    static_assert(::qduino::arduino::is_loop_id(id), "loop(id, budget, period, core): id is 1 to 32");       \
    static_assert(::qduino::arduino::is_budget(::qduino::arduino::to_duration(qduino_time_unit(0), budget),  \
                                               ::qduino::arduino::to_duration(qduino_time_unit(0), period)), \
                  "loop(id, budget, period, core): 0 < budget <= period");                                   \
    [[maybe_unused]] static const ::qduino::arduino::LoopRegistration qduino_loop_registration_##n{          \
        id,                                                                                                  \
        ::qduino::arduino::to_duration(qduino_time_unit(0), budget),                                         \
        ::qduino::arduino::to_duration(qduino_time_unit(0), period),                                         \
        core,                                                                                                \
        ::qduino::arduino::to_duration(qduino_time_unit(0), sleep),                                          \
        sleeps,                                                                                              \
        &qduino_loop_body_##n,                                                                               \
        __FILE__,                                                                                            \
        __LINE__};                                                                                           \
    static void qduino_loop_body_##n()

/// TIME_UNIT(us) at the top of a sketch sets the unit of plain numbers in loop(…) and the …Vcpu
/// calls below it: ns, cycles, us, ms or s. A semicolon after it is allowed and not needed.
#define TIME_UNIT(unit)                                                                   \
    [[maybe_unused]] static constexpr ::qduino::arduino::TimeUnit qduino_time_unit(int) { \
        return ::qduino::arduino::TimeUnit::unit;                                         \
    }

/// For a sketch that is a .cpp file: at its end, in place of the lines that the .ino converter
/// writes. With a classic loop(): QDUINO_SKETCH(&setup, &loop); without: QDUINO_SKETCH(&setup,
/// nullptr).
#define QDUINO_SKETCH(setup_function, loop_function)                                                 \
    [[maybe_unused]] static const ::qduino::arduino::SketchRegistration qduino_sketch_registration { \
        setup_function, loop_function, nullptr, __FILE__                                             \
    }

// ---- interrupts: the device is a bare word, found where it cannot collide with the sketch's -----
#define QDUINO_ROUTE(name, ...)                                                                              \
    QDUINO_SELECT(__VA_ARGS__ __VA_OPT__(, ) 0, 0, 0, 0, 0, QDUINO_ROUTED, QDUINO_BARE, QDUINO_BARE, unused) \
    (name, __VA_ARGS__)
#define QDUINO_BARE(name, ...) name(__VA_ARGS__)
#define QDUINO_ROUTED(name, device, core) name(::qduino::arduino::device_class::device, core)
#define noInterrupts(...) QDUINO_ROUTE(noInterrupts, __VA_ARGS__)
#define interrupts(...) QDUINO_ROUTE(interrupts, __VA_ARGS__)
// The AVR's names for them, without arguments.
#define cli() noInterrupts()
#define sei() interrupts()
#define interruptsVcpu(device, ...) \
    interruptsVcpu(qduino_time_unit(0), ::qduino::arduino::device_class::device, __VA_ARGS__)
#define attachInterruptVcpu(...) attachInterruptVcpu(qduino_time_unit(0), __VA_ARGS__)
#define promiseProgress(...) promiseProgress(qduino_time_unit(0), __VA_ARGS__)

// ---- round, word -------------------------------------------------------------------------------
#define round(x) round(::qduino::arduino::RoundArgument(x))
#define word(...) makeWord(__VA_ARGS__)
