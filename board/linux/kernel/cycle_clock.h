// CLOCK_MONOTONIC at half the price: worked out from the cycle counter, starting from a recent
// reading of both.
//
//   monotonic  ┊          × now = anchor + (cycles - anchor's cycles) x rate
//              ┊      ·
//              ┊  × anchor: both clocks read at once, at most 1 ms ago
//              ┊  ·
//              × base: an anchor of some 0.1 s ago, at first less; the slope from it is the rate
//              └───────────── cycles
//
// A reading through the vDSO costs 24 ns, now() 19, and soon() 10 (EPYC VM, kernel 6.18). A 10 kHz
// train that spins between its pulses pays for four readings a period.
//
// soon() is quicker because it has no lfence: it does not wait for earlier instructions to finish.
// The counter may then be read while the message of another core is still on its way, so an answer
// to that message may carry a time up to some 0.2 us early. A spin can live with that, because it
// looks again. A write to a pin lives with it, too: the edges of two cores that answer each other
// within 0.2 us may be played in either order, unless a lock is between them
// (pi_lock.cpp).
//
// The error against CLOCK_MONOTONIC is half the width of the reading that made the anchor (some 20
// ns), plus what the kernel's clock is slewed by in 1 ms (0.5 us at ntpd's steepest; 0 nearly
// always). An anchor never sets the clock back. A caller that comes while the anchor is being set
// reads the kernel's clock instead. That agrees within those 20 ns, which is less than it takes to
// hand an instant from core to core.
//
// Used where the kernel itself keeps time by the cycle counter (x86-64, clock source `tsc`).
// Elsewhere both calls are the kernel's. One per process. All calls from any thread and from signal
// handlers; none blocks.
#pragma once

#include <atomic>
#include <cstdint>

#include "board/linux/kernel/clock.h"

namespace qduino::board::linux {

// The compiler's own words: <x86intrin.h> has 54,000 lines, and half of the programs read them.
inline std::uint64_t read_cycles() {
#if defined(__x86_64__)
    return __builtin_ia32_rdtsc();
#else
    return 0;
#endif
}

/// Finishes everything earlier in the program before anything later begins: loads too, which the
/// order of a store does not bind.
inline void finish_loads() {
#if defined(__x86_64__)
    __builtin_ia32_lfence();
#endif
}

class CycleClock {
  public:
    /// Checks whether the counter can be used, and measures its rate: some 3 ms. Setup-time; a
    /// second call has no effect.
    void start();
    [[nodiscard]] bool started() const { return started_.load(std::memory_order_acquire); }

    /// The time after everything that the caller has seen.
    [[nodiscard]] Instant now() {
        finish_loads();
        return soon();
    }
    /// The same at half the price, perhaps 0.2 us early: see above.
    [[nodiscard]] Instant soon() {
        Instant result;
        return read(result) ? result : refreshed_now();
    }
    /// Sets a new anchor when the present one has reached half of its greatest age. A thread calls
    /// it when it has time, and so needs none later.
    void keep_fresh() {
        if (started() && cycles_since_anchor() > oldest_.load(std::memory_order_relaxed) / 2)
            refresh(kPatience);
    }

    /// The greatest age of an anchor.
    static constexpr Nanoseconds kAnchorAge = 1ms;

  private:
    /// Both clocks, read at once.
    struct Pair {
        std::uint64_t cycles = 0;
        std::int64_t ns = 0;
        /// Cycles from the look at the counter before the clock's to the one after.
        std::uint64_t width = 0;
    };
    static constexpr int kRateBits = 32;  ///< a rate is nanoseconds a cycle times 2^32
    static constexpr int kPatience = 5;   ///< readings, of a thread that has time for them

    [[nodiscard]] std::uint64_t cycles_since_anchor() const {
        return read_cycles() - cycles_.load(std::memory_order_acquire);
    }
    /// The time from the anchor. False when the anchor is too old, is being set, or is not there
    /// yet (oldest_ is 0).
    [[nodiscard]] bool read(Instant& result) const {
        const std::uint32_t before = sequence_.load(std::memory_order_acquire);
        const std::uint64_t passed = cycles_since_anchor();
        const std::uint64_t rate = rate_.load(std::memory_order_acquire);
        const std::int64_t from_ns = ns_.load(std::memory_order_acquire);
        const bool too_old = passed >= oldest_.load(std::memory_order_acquire);
        if (sequence_.load(std::memory_order_relaxed) != before || (before & 1u) != 0 || too_old)
            return false;
        result = instant_from_ns(from_ns + static_cast<std::int64_t>((passed * rate) >> kRateBits));
        return true;
    }
    [[nodiscard]] Instant refreshed_now() { return started() ? refresh(1) : monotonic_now(); }
    Instant refresh(int attempts);
    [[nodiscard]] static Pair read_pair(std::uint64_t good_width, int attempts = kPatience);
    [[nodiscard]] std::int64_t set_anchor(const Pair& pair);
    void set_rate(const Pair& from, const Pair& to);
    [[nodiscard]] std::int64_t never_back(const Pair& pair) const;

    std::atomic<bool> started_{false};
    std::uint64_t good_width_ = 0;

    // A seqlock. The thread that made `sequence_` odd writes with releases; readers use acquires.
    // So a reader that sees a new value also sees the odd number.
    alignas(64) std::atomic<std::uint32_t> sequence_{0};
    std::atomic<std::uint64_t> cycles_{0};  // the anchor …
    std::atomic<std::int64_t> ns_{0};
    std::atomic<std::uint64_t> rate_{0};
    std::atomic<std::uint64_t> oldest_{0};  // … and for how many cycles it holds
    // Only the writer's:
    Pair base_;
    std::int64_t next_span_ = 0;  // how far from the base the rate is measured next
};

/// The one of this process.
extern CycleClock cycle_clock;

}  // namespace qduino::board::linux
