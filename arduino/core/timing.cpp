#include "arduino/core/timing.h"

#include <algorithm>

#include "arduino/core/sketch_yield.h"
#include "board/board.h"
#include "runtime/runtime.h"

namespace board = qduino::board;
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

/// A board's clock may have run before the program: on Linux since the computer's start.
Nanoseconds since_start() {
    const auto* runtime = qduino::runtime::Runtime::current();
    return board::current().now() - (runtime ? runtime->made_at() : qduino::kEpoch);
}

/// How often delay() calls the yield() of a sketch.
constexpr Nanoseconds kBetweenYields{1'000'000};

constexpr std::size_t kSetupWorksMax = 4;
void (*setup_works[kSetupWorksMax])(qduino::Instant) = {};

}  // namespace

void qduino::arduino::set_setup_work(void (*work)(Instant)) {
    for (auto& place : setup_works) {
        if (place && place != work) continue;
        place = work;
        return;
    }
}

void qduino::arduino::wait_until(Instant until) {
    if (board::current().current_vcpu() == qduino::board::kNoVcpu) {
        for (auto* work : setup_works) {
            if (work) work(until);
        }
    }
    board::current().sleep_until(until);
}

std::uint64_t qduino_millis() { return static_cast<std::uint64_t>(to_ns(since_start()) / 1'000'000); }
std::uint64_t qduino_micros() { return static_cast<std::uint64_t>(to_ns(since_start()) / 1'000); }

unsigned long millis() { return qduino_millis(); }
unsigned long micros() { return qduino_micros(); }
unsigned long long nanos() { return static_cast<unsigned long long>(to_ns(board::current().now())); }

void delay(unsigned long ms) {
    const qduino::Instant until = board::current().now() + duration_of(ms, 1'000'000);
    while (qduino::arduino::sketch_has_yield() && board::current().now() < until) {
        yield();
        qduino::arduino::wait_until(std::min(until, board::current().now() + kBetweenYields));
    }
    qduino::arduino::wait_until(until);
}
void delayMicroseconds(unsigned long us) { board::current().busy_for(duration_of(us, 1'000)); }
void delayBusyMicroseconds(unsigned long us) { delayMicroseconds(us); }
void delayBusyNanoseconds(unsigned long ns) { board::current().busy_for(duration_of(ns, 1)); }

void delayBusyUntil(unsigned long long t_ns) {
    board::current().busy_until(qduino::kEpoch + duration_of(t_ns, 1));
}
