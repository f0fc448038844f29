#include "board/linux/interference.h"

#include <algorithm>
#include <vector>

#include "board/linux/bare_spin.h"
#include "board/linux/real_time_thread.h"

namespace qduino::board::linux {
namespace {

/// Two looks at the clock are some 50 ns apart. No interrupt is shorter than this.
constexpr Nanoseconds kGap = 1us;
constexpr double kMargin = 1.5;

Nanoseconds with_margin(Nanoseconds length) {
    return Nanoseconds{static_cast<std::int64_t>(kMargin * static_cast<double>(length.count()))};
}

}  // namespace

Interference measure_interference(int core, Nanoseconds duration, int priority) {
    Interference found;
    const bool ran = run_apart([&] {
        if (!pin_to_core(core) || !become_real_time(priority)) return;
        std::vector<Nanoseconds> gaps;
        gaps.reserve(4096);
        const auto counted = spin_and_count(core, duration, [&gaps](Nanoseconds between) {
            if (between > kGap && gaps.size() < gaps.capacity()) gaps.push_back(between);
        });
        found.per_second =
            std::max(static_cast<double>(gaps.size()) / to_seconds(duration), counted.value_or(0));
        found.measured = true;
        if (gaps.empty()) return;
        std::ranges::sort(gaps);
        found.usual = gaps[gaps.size() * 9 / 10];
        found.longest = gaps.size() > 1 ? gaps[gaps.size() - 2] : found.usual;
        found.worst = gaps.back();
    });
    return ran ? found : Interference{};
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
