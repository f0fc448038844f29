#include "board/linux/kernel/cycle_clock.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "board/linux/kernel/kernel_text.h"

namespace qduino::board::linux {

namespace {

// The rate is measured over 2 ms first, then over 4, 8 and so on, and from 100 ms on over each 100
// ms. 2 ms make it good to 20 ppm, or 20 ns over the age of an anchor; 100 ms make it good to 0.3
// ppm.
constexpr Nanoseconds kFirstBase = 2ms;
constexpr Nanoseconds kLongBase = 100ms;
/// A slope that differs more from the rate is not believed: the computer was suspended or moved in
/// between.
constexpr double kBelievable = 1e-3;
/// An anchor may lie this much behind its predecessor, by the width of their readings. More is
/// another time.
constexpr std::int64_t kJitterNs = 1000;

bool kernel_trusts_cycles() {
#if defined(__x86_64__)
    return text_of_file("/sys/devices/system/clocksource/clocksource0/current_clocksource")
        .starts_with("tsc");
#else
    return false;
#endif
}

}  // namespace

CycleClock cycle_clock;

/// The narrowest of a few tries: an interruption makes a reading wide.
CycleClock::Pair CycleClock::read_pair(std::uint64_t good_width, int attempts) {
    Pair best{.cycles = 0, .ns = 0, .width = std::numeric_limits<std::uint64_t>::max()};
    for (int attempt = 0; attempt < attempts && best.width > good_width; ++attempt) {
        finish_loads();
        const std::uint64_t before = read_cycles();
        const std::int64_t ns = read_clock_ns(CLOCK_MONOTONIC);
        finish_loads();
        const std::uint64_t width = read_cycles() - before;
        if (width < best.width) best = {before + width / 2, ns, width};
    }
    return best;
}

void CycleClock::start() {
    if (started() || !kernel_trusts_cycles()) return;
    std::uint64_t narrowest = std::numeric_limits<std::uint64_t>::max();
    for (int i = 0; i < 100; ++i) narrowest = std::min(narrowest, read_pair(0).width);
    good_width_ = narrowest + narrowest / 4;
    base_ = read_pair(good_width_);
    block_until(instant_from_ns(base_.ns) + kFirstBase);
    set_rate(base_, read_pair(good_width_));
    next_span_ = 2 * kFirstBase.count();
    started_.store(true, std::memory_order_release);
    refresh(kPatience);
}

void CycleClock::set_rate(const Pair& from, const Pair& to) {
    const double slope = static_cast<double>(to.ns - from.ns) / static_cast<double>(to.cycles - from.cycles);
    if (!(slope > 0)) return;
    const double rate = std::ldexp(slope, kRateBits);
    const auto known = static_cast<double>(rate_.load(std::memory_order_relaxed));
    if (known > 0 && std::abs(rate / known - 1) > kBelievable) return;
    rate_.store(static_cast<std::uint64_t>(rate), std::memory_order_release);
    oldest_.store(static_cast<std::uint64_t>(static_cast<double>(kAnchorAge.count()) / slope),
                  std::memory_order_release);
}

/// The instant of `pair`; or the latest instant already handed out, when that is later by no more
/// than jitter.
std::int64_t CycleClock::never_back(const Pair& pair) const {
    const std::uint64_t passed = std::min(pair.cycles - cycles_.load(std::memory_order_relaxed),
                                          oldest_.load(std::memory_order_relaxed));
    const std::int64_t handed_out =
        ns_.load(std::memory_order_relaxed) +
        static_cast<std::int64_t>((passed * rate_.load(std::memory_order_relaxed)) >> kRateBits);
    return handed_out - pair.ns <= kJitterNs ? std::max(pair.ns, handed_out) : pair.ns;
}

/// Reads both clocks, sets the anchor and returns the time. A caller with time for one attempt
/// takes a wide reading as the kernel's time, and leaves the anchor to the next caller, which finds
/// the code in its caches.
Instant CycleClock::refresh(int attempts) {
    std::uint32_t even = sequence_.load(std::memory_order_relaxed) & ~1u;
    // Another thread sets the anchor.
    if (!sequence_.compare_exchange_strong(even, even + 1, std::memory_order_acquire)) return monotonic_now();
    const Pair pair = read_pair(good_width_, attempts);
    const bool good = attempts > 1 || pair.width <= good_width_;
    const std::int64_t ns = good ? set_anchor(pair) : pair.ns;
    sequence_.store(even + 2, std::memory_order_release);
    return instant_from_ns(ns);
}

/// Contract: `sequence_` is odd, and made so by the caller.
std::int64_t CycleClock::set_anchor(const Pair& pair) {
    const std::int64_t ns = never_back(pair);
    const bool good_for_rate = pair.width <= 2 * good_width_;
    if (good_for_rate && pair.ns - base_.ns >= next_span_) {
        set_rate(base_, pair);
        if (next_span_ >= kLongBase.count()) base_ = pair;
        next_span_ = std::min(2 * next_span_, kLongBase.count());
    }
    cycles_.store(pair.cycles, std::memory_order_release);
    ns_.store(ns, std::memory_order_release);
    return ns;
}

}  // namespace qduino::board::linux
