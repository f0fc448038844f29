// The board's clock: nanoseconds since boot, from the processor's counter.
//
//   x86-64     the time-stamp counter. Every core reads its own. They are taken to be one clock,
//              which needs a counter that is invariant and was started everywhere at once (Intel
//              SDM volume 3, 17.17)
//   aarch64    the virtual counter of the generic timer, which is one for all cores
//
// clock_is_invariant() says whether the processor promises it; the guarantee report says so when it
// does not. The date is this clock and one number, which a clock that runs without power tells at
// the start (driver/cmos_clock.h, driver/pl031.h).
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "base/time.h"
#include "board/metal/computer/instructions.h"

namespace qduino::board::metal {

class ComputerClock {
  public:
    /// `hz` ticks a second; `origin` is instant 0. Before any other call.
    void set(std::uint64_t hz, std::uint64_t origin) {
        constexpr std::uint64_t kSecond = 1'000'000'000;
        hz_ = hz;
        origin_ = origin;
        ns_of_tick_ = static_cast<std::uint64_t>((Wide{kSecond} << kFraction) / hz);
        ticks_of_ns_ = static_cast<std::uint64_t>((Wide{hz} << kFraction) / kSecond);
    }
    [[nodiscard]] std::uint64_t hz() const { return hz_; }

    [[nodiscard]] Instant now() const { return instant_at(clock_count()); }
    /// It is now `seconds` since 1970, UTC. Nothing: nobody knows, and 1970 begins with instant 0.
    void set_date(std::optional<std::int64_t> seconds) {
        if (seconds) instant_0_ = Nanoseconds{std::chrono::seconds{*seconds}} - (now() - kEpoch);
    }
    /// The date of instant 0, as time since 1970.
    [[nodiscard]] Nanoseconds date_of_instant_0() const { return instant_0_; }

    /// now() when the counter stands at `count`.
    [[nodiscard]] Instant instant_at(std::uint64_t count) const {
        return instant_from_ns(static_cast<std::int64_t>(Wide{count - origin_} * ns_of_tick_ >> kFraction));
    }
    /// The first count at which now() >= t. Contract: t is not before instant 0.
    [[nodiscard]] std::uint64_t count_at(Instant t) const {
        // Both factors are a little too small, and what that makes grows with the time since boot.
        std::uint64_t count = origin_ + ticks_in(t - kEpoch);
        for (Nanoseconds missing; (missing = t - instant_at(count)) > Nanoseconds{0};)
            count += std::max<std::uint64_t>(ticks_in(missing - Nanoseconds{1}), 1);
        return count;
    }

  private:
    __extension__ using Wide = unsigned __int128;
    static constexpr int kFraction = 40;

    [[nodiscard]] std::uint64_t ticks_in(Nanoseconds length) const {
        return static_cast<std::uint64_t>(static_cast<Wide>(length.count()) * ticks_of_ns_ >> kFraction);
    }

    std::uint64_t hz_ = 0, origin_ = 0;
    std::uint64_t ns_of_tick_ = 0, ticks_of_ns_ = 0;  // both with kFraction binary places
    Nanoseconds instant_0_{0};                        // when that was, since 1970
};

inline constinit ComputerClock computer_clock;

}  // namespace qduino::board::metal
