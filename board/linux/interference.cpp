#include "board/linux/interference.h"

#include <algorithm>
#include <system_error>
#include <thread>
#include <vector>

#include "board/linux/clock.h"
#include "board/linux/core_probe.h"
#include "board/linux/fatal_signals.h"
#include "board/linux/real_time_thread.h"

namespace qduino::board::linux {
namespace {

/// Two looks at the clock are some 50 ns apart. No interrupt is shorter than this.
constexpr Nanoseconds kGap = 1us;
constexpr double kMargin = 1.5;

Nanoseconds with_margin(Nanoseconds length) {
    return Nanoseconds{static_cast<std::int64_t>(kMargin * static_cast<double>(length.count()))};
}

std::vector<Nanoseconds> gaps_of_a_spin(Nanoseconds duration) {
    std::vector<Nanoseconds> gaps;
    gaps.reserve(4096);
    const Instant end = monotonic_now() + duration;
    for (Instant last = monotonic_now(); last < end;) {
        const Instant now = monotonic_now();
        if (now - last > kGap && gaps.size() < gaps.capacity()) gaps.push_back(now - last);
        last = now;
    }
    return gaps;
}

}  // namespace

Interference measure_interference(int core, Nanoseconds duration, int priority) {
    Interference found;
    const auto spin = [&] {
        if (!pin_to_core(core) || !become_real_time(priority)) return;
        const auto before = interrupts_of(core);
        std::vector<Nanoseconds> gaps = gaps_of_a_spin(duration);
        const auto after = interrupts_of(core);
        const double counted = before && after ? static_cast<double>(*after - *before) : 0;
        found.per_second = std::max(static_cast<double>(gaps.size()), counted) / to_seconds(duration);
        found.measured = true;
        if (gaps.empty()) return;
        std::ranges::sort(gaps);
        found.usual = gaps[gaps.size() * 9 / 10];
        found.longest = gaps.size() > 1 ? gaps[gaps.size() - 2] : found.usual;
        found.worst = gaps.back();
    };
    const StopSignalsBlocked for_the_thread;
    try {
        std::thread{spin}.join();
    } catch (const std::system_error&) {
        found.measured = false;
    }
    return found;
}

sched::PlatformInterferer Interference::counted() const {
    const Nanoseconds interval = from_seconds(1 / (kMargin * std::max(per_second, 1.0)));
    return {.name = "interrupts", .cost = with_margin(usual), .interval = interval, .jitter = interval};
}

sched::PlatformInterferer Interference::counted_once() const {
    return {.name = "longest interrupt",
            .cost = with_margin(longest),
            .interval = sched::kPeriodMax,
            .jitter = Nanoseconds{0}};
}

}  // namespace qduino::board::linux
