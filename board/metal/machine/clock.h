// The board's clock: nanoseconds since boot, from the processor's counter.
//
//   x86-64     the time-stamp counter. Every core reads its own. They are taken to be one clock,
//              which needs a counter that is invariant and was started everywhere at once (Intel
//              SDM volume 3, 17.17)
//   aarch64    the virtual counter of the generic timer, which is one for all cores
//
// clock_is_invariant() says whether the processor promises it; the guarantee report says so when it
// does not.
#pragma once

#include <cstdint>

#include "base/time.h"
#include "board/metal/machine/instructions.h"

namespace qduino::board::metal {

class MachineClock {
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

    [[nodiscard]] Instant now() const {
        const std::uint64_t ticks = clock_count() - origin_;
        return instant_from_ns(static_cast<std::int64_t>(Wide{ticks} * ns_of_tick_ >> kFraction));
    }
    /// The first count at which now() >= t. Contract: t is not before instant 0.
    [[nodiscard]] std::uint64_t count_at(Instant t) const {
        const auto ns = static_cast<std::uint64_t>(to_ns(t));
        // Each factor may be too small by one part in 2^40, and each product by one.
        return origin_ + static_cast<std::uint64_t>(Wide{ns} * ticks_of_ns_ >> kFraction) + (ns >> 30) + 2;
    }

  private:
    __extension__ using Wide = unsigned __int128;
    static constexpr int kFraction = 40;

    std::uint64_t hz_ = 0;
    std::uint64_t origin_ = 0;
    std::uint64_t ns_of_tick_ = 0;  // both with kFraction binary places
    std::uint64_t ticks_of_ns_ = 0;
};

inline constinit MachineClock machine_clock;

}  // namespace qduino::board::metal
