#include "arduino/core/timing.h"

#include "arduino/core/setup_work.h"
#include "runtime/port.h"

namespace port = qduino::port;
using qduino::instant_from_ns;
using qduino::Nanoseconds;
using qduino::to_ns;

namespace {

/// Longer than any program runs (146 years), short enough that now + it does not overflow.
constexpr unsigned long long kLongestNs = 1ULL << 62;

/// count · ns_per_unit, held below kLongestNs.
Nanoseconds duration_of(unsigned long long count, unsigned long long ns_per_unit) {
    const bool fits = count < kLongestNs / ns_per_unit;
    return Nanoseconds{static_cast<std::int64_t>(fits ? count * ns_per_unit : kLongestNs)};
}

void (*setup_work)(qduino::Instant) = nullptr;

}  // namespace

void qduino::arduino::set_setup_work(void (*work)(Instant)) { setup_work = work; }

unsigned long millis() { return static_cast<unsigned long>(to_ns(port::now()) / 1'000'000); }
unsigned long micros() { return static_cast<unsigned long>(to_ns(port::now()) / 1'000); }
unsigned long long nanos() { return static_cast<unsigned long long>(to_ns(port::now())); }

void delay(unsigned long ms) {
    const qduino::Instant until = port::now() + duration_of(ms, 1'000'000);
    if (setup_work && port::current_vcpu() == qduino::board::kNoVcpu) setup_work(until);
    port::sleep_until(until);
}
void delayMicroseconds(unsigned long us) { port::busy_for(duration_of(us, 1'000)); }
void delayBusyMicroseconds(unsigned long us) { delayMicroseconds(us); }
void delayBusyNanoseconds(unsigned long ns) { port::busy_for(duration_of(ns, 1)); }

qduino::Instant timeNow() { return port::now(); }
void delayBusyUntil(qduino::Instant t) { port::busy_until(t); }
void delayBusyUntil(unsigned long long t_ns) { port::busy_until(qduino::kEpoch + duration_of(t_ns, 1)); }
void delayUntil(qduino::Instant t) { port::sleep_until(t); }

void yield() { port::yield(); }
