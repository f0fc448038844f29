// Time as a parameter.
//
// Every instant in the project is an `Instant`: nanoseconds of a clock that cannot be read. `Clock` has no
// `now()` on purpose: only a board hands out the time (ARCHITECTURE.md, "Time and units"), so pure code
// cannot read it behind its caller's back and runs the same in virtual time.
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

/// The instant before everything; what an empty timer compares against is never this one (use std::optional).
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
