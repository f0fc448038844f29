// FastLED's beats, and what is done every so often. All of it reads millis().
#pragma once

#include "arduino/core/timing.h"
#include "arduino/core/wiring.h"
#include "arduino/libraries/FastLED/fastled/math8.h"

#define GET_MILLIS millis

/// A saw tooth so many times a minute, in 256ths; off by 0.05 %.
inline std::uint16_t beat88(accum88 beats_256, std::uint32_t from_ms = 0) {
    const auto passed = static_cast<std::uint32_t>(millis()) - from_ms;
    return static_cast<std::uint16_t>(passed * beats_256 * 280u >> 16);
}
/// Below 256: whole beats a minute; else in 256ths.
inline std::uint16_t beat16(accum88 beats, std::uint32_t from_ms = 0) {
    return beat88(beats < 256 ? static_cast<accum88>(beats << 8) : beats, from_ms);
}
inline std::uint8_t beat8(accum88 beats, std::uint32_t from_ms = 0) {
    return static_cast<std::uint8_t>(beat16(beats, from_ms) >> 8);
}
/// A sine between `lowest` and `highest`, so many times a minute.
inline std::uint16_t beatsin88(accum88 beats_256, std::uint16_t lowest = 0, std::uint16_t highest = 65535,
                               std::uint32_t from_ms = 0, std::uint16_t phase = 0) {
    const auto wave = static_cast<std::uint16_t>(
        sin16(static_cast<std::uint16_t>(beat88(beats_256, from_ms) + phase)) + 32768);
    return static_cast<std::uint16_t>(lowest + scale16(wave, static_cast<std::uint16_t>(highest - lowest)));
}
inline std::uint16_t beatsin16(accum88 beats, std::uint16_t lowest = 0, std::uint16_t highest = 65535,
                               std::uint32_t from_ms = 0, std::uint16_t phase = 0) {
    return beatsin88(beats < 256 ? static_cast<accum88>(beats << 8) : beats, lowest, highest, from_ms, phase);
}
inline std::uint8_t beatsin8(accum88 beats, std::uint8_t lowest = 0, std::uint8_t highest = 255,
                             std::uint32_t from_ms = 0, std::uint8_t phase = 0) {
    return map8(sin8(add8(beat8(beats, from_ms), phase)), lowest, highest);
}

inline std::uint16_t seconds16() { return static_cast<std::uint16_t>(millis() / 1000); }
inline std::uint16_t minutes16() { return static_cast<std::uint16_t>(millis() / 60'000); }
inline std::uint8_t hours8() { return static_cast<std::uint8_t>(millis() / 3'600'000); }
/// Seconds of 1024 ms.
inline std::uint16_t bseconds16() { return static_cast<std::uint16_t>(millis() >> 10); }

namespace qduino::arduino::fastled {

inline std::uint32_t milliseconds32() { return static_cast<std::uint32_t>(millis()); }

/// True once in each period, when it is asked.
template <typename Time, Time (*Now)()>
class EveryN {
  public:
    explicit EveryN(Time period = 1) : begun_(Now()), period_(period) {}
    void setPeriod(Time period) { period_ = period; }
    [[nodiscard]] Time getTime() const { return Now(); }
    [[nodiscard]] Time getPeriod() const { return period_; }
    [[nodiscard]] Time getElapsed() const { return static_cast<Time>(Now() - begun_); }
    [[nodiscard]] Time getRemaining() const { return static_cast<Time>(period_ - getElapsed()); }
    [[nodiscard]] Time getLastTriggerTime() const { return begun_; }
    bool ready() {
        const bool over = getElapsed() >= period_;
        if (over) reset();
        return over;
    }
    void reset() { begun_ = Now(); }
    /// It is ready at once.
    void trigger() { begun_ = static_cast<Time>(Now() - period_); }
    explicit operator bool() { return ready(); }

  private:
    Time begun_, period_;
};

}  // namespace qduino::arduino::fastled

using CEveryNMillis =
    qduino::arduino::fastled::EveryN<std::uint32_t, qduino::arduino::fastled::milliseconds32>;
using CEveryNMilliseconds = CEveryNMillis;
using CEveryNSeconds = qduino::arduino::fastled::EveryN<std::uint16_t, seconds16>;
using CEveryNBSeconds = qduino::arduino::fastled::EveryN<std::uint16_t, bseconds16>;
using CEveryNMinutes = qduino::arduino::fastled::EveryN<std::uint16_t, minutes16>;
using CEveryNHours = qduino::arduino::fastled::EveryN<std::uint8_t, hours8>;

#define QDUINO_EVERY_JOIN_(a, b) a##b
#define QDUINO_EVERY_NAME_(number) QDUINO_EVERY_JOIN_(qduino_every_, number)
#define QDUINO_EVERY_(Timer, name, period) \
    static Timer name(period);             \
    if (name)
#define EVERY_N_MILLIS_I(name, n) QDUINO_EVERY_(CEveryNMillis, name, n)
#define EVERY_N_MILLISECONDS_I(name, n) QDUINO_EVERY_(CEveryNMillis, name, n)
#define EVERY_N_SECONDS_I(name, n) QDUINO_EVERY_(CEveryNSeconds, name, n)
#define EVERY_N_BSECONDS_I(name, n) QDUINO_EVERY_(CEveryNBSeconds, name, n)
#define EVERY_N_MINUTES_I(name, n) QDUINO_EVERY_(CEveryNMinutes, name, n)
#define EVERY_N_HOURS_I(name, n) QDUINO_EVERY_(CEveryNHours, name, n)
#define EVERY_N_MILLIS(n) EVERY_N_MILLIS_I(QDUINO_EVERY_NAME_(__COUNTER__), n)
#define EVERY_N_MILLISECONDS(n) EVERY_N_MILLIS_I(QDUINO_EVERY_NAME_(__COUNTER__), n)
#define EVERY_N_SECONDS(n) EVERY_N_SECONDS_I(QDUINO_EVERY_NAME_(__COUNTER__), n)
#define EVERY_N_BSECONDS(n) EVERY_N_BSECONDS_I(QDUINO_EVERY_NAME_(__COUNTER__), n)
#define EVERY_N_MINUTES(n) EVERY_N_MINUTES_I(QDUINO_EVERY_NAME_(__COUNTER__), n)
#define EVERY_N_HOURS(n) EVERY_N_HOURS_I(QDUINO_EVERY_NAME_(__COUNTER__), n)
/// The period is asked each time.
#define EVERY_N_MILLISECONDS_DYNAMIC_I(name, n) \
    static CEveryNMillis name(1);               \
    name.setPeriod(n);                          \
    if (name)
#define EVERY_N_MILLISECONDS_DYNAMIC(n) EVERY_N_MILLISECONDS_DYNAMIC_I(QDUINO_EVERY_NAME_(__COUNTER__), n)
