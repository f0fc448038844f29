// How a sketch declares its loops: the expansion of the macros in core/macros.h.
//
//   void loop(2, 10us, 100us, 1) { body }
//
//   becomes    void static body_7();                         the sketch's `void` begins this line
//              static const LoopRegistration r_7{…, body_7}; enters the table before main()
//              static void body_7() { body }
//
// The whole declaration is checked where it stands: an id outside 1–32, or a budget above the
// period, does not compile.
#pragma once

#include <chrono>
#include <cstdint>
#include <type_traits>

#include "base/time.h"
#include "board/types.h"
#include "runtime/sketch.h"

namespace qduino::arduino {

/// The unit of a plain number in loop(), interruptsVcpu() and attachInterruptVcpu().
enum class TimeUnit : std::int64_t { ns = 1, cycles = 1, us = 1'000, ms = 1'000'000, s = 1'000'000'000 };

/// A plain number in `unit`.
template <typename T>
requires std::is_arithmetic_v<T>
constexpr Nanoseconds to_duration(TimeUnit unit, T count) {
    if constexpr (std::is_integral_v<T>) {
        return Nanoseconds{static_cast<std::int64_t>(count) * static_cast<std::int64_t>(unit)};
    } else {
        return Nanoseconds{
            static_cast<std::int64_t>(count * static_cast<T>(static_cast<std::int64_t>(unit)) + T{0.5})};
    }
}
/// A std::chrono duration says its unit itself.
template <typename Rep, typename Period>
constexpr Nanoseconds to_duration(TimeUnit, std::chrono::duration<Rep, Period> duration) {
    return std::chrono::duration_cast<Nanoseconds>(duration);
}

constexpr bool is_loop_id(long long id) { return id >= 1 && id <= board::kMaxLoop; }
constexpr bool is_budget(Nanoseconds budget, Nanoseconds period) {
    return budget.count() > 0 && budget <= period;
}

/// Enters one loop into the sketch's table. Static objects only.
struct LoopRegistration {
    /// `sleeps`: in how many pieces a release sleeps; 0: nobody says.
    LoopRegistration(int id, Nanoseconds budget, Nanoseconds period, int core, Nanoseconds sleep, int sleeps,
                     void (*body)(), const char* file, int line);
};

/// Enters setup(), and the classic loop() if there is one: 80 of 100 ms, on any core, with the
/// lowest free id. `serial_event` (may be null) is called after each pass of loop() when Serial has
/// something to read.
struct SketchRegistration {
    SketchRegistration(void (*setup)(), void (*loop)(), void (*serial_event)(), const char* file);
};

/// Calls `handler`, the sketch's serialEvent(), if Serial has something to read. The language has
/// it (HardwareSerial.cpp): this room knows no port.
void run_serial_event(void (*handler)());

/// Enters a loop that setup() makes, on any core. Its budget comes back whole at each release, so
/// it may sleep where it likes (sched::Vcpu::deferrable). Returns its id; 0: it is not setup() that
/// calls, or the table is full.
board::VcpuId enter_loop_of_setup(Nanoseconds budget, Nanoseconds period, void (*body)(), const char* name);

/// `action` is called once, just before setup(): for what a static object's constructor asked too
/// early. Contract: no more than eight different ones.
void before_setup(void (*action)());

inline constexpr Nanoseconds kClassicLoopBudget{80'000'000};
inline constexpr Nanoseconds kClassicLoopPeriod{100'000'000};

}  // namespace qduino::arduino

/// The unit where the sketch names none; TIME_UNIT declares a better overload.
constexpr qduino::arduino::TimeUnit qduino_time_unit(...) { return qduino::arduino::TimeUnit::ms; }
