// Time as a parameter.
//
// Code that reads a clock behind its caller's back cannot run in virtual time, nor be tested at a
// chosen instant. So an `Instant` is nanoseconds of a clock that has no `now()`: only a board hands
// out the time (ARCHITECTURE.md, "Time and units").
#pragma once

#include <chrono>
#include <cstdint>
#include <ratio>

namespace qduino {

/// Nanoseconds in 64 bits: 292 years, exact. The only duration type that crosses an interface.
using Nanoseconds = std::chrono::duration<std::int64_t, std::nano>;

/// The board's monotonic clock. It has no now(): ask the board.
struct Clock {
    using rep = std::int64_t;
    using period = std::nano;
    using duration = Nanoseconds;
    using time_point = std::chrono::time_point<Clock, Nanoseconds>;
    static constexpr bool is_steady = true;
};

/// A point in time, nanoseconds since the board started its clock.
using Instant = Clock::time_point;

/// The instant before everything. It is a valid instant: a timer that is not set is an empty
/// std::optional, and not this.
inline constexpr Instant kEpoch{};
/// Later than any instant that happens.
inline constexpr Instant kForever = Instant::max();

constexpr Instant instant_from_ns(std::int64_t ns) { return Instant{Nanoseconds{ns}}; }
constexpr std::int64_t to_ns(Instant t) { return t.time_since_epoch().count(); }
constexpr std::int64_t to_ns(Nanoseconds d) { return d.count(); }
/// Seconds as a double: for physics and reports, never for a deadline.
constexpr double to_seconds(Nanoseconds d) { return static_cast<double>(d.count()) * 1e-9; }
/// Nearest nanosecond. `s` must be within ±9.2e9 s.
constexpr Nanoseconds from_seconds(double s) {
    return Nanoseconds{static_cast<std::int64_t>(s * 1e9 + (s < 0 ? -0.5 : 0.5))};
}

using namespace std::chrono_literals;

}  // namespace qduino
