#include "sched/load.h"

#include <algorithm>

#include "base/contract.h"
#include "sched/exact.h"

namespace qduino::sched {

Nanoseconds PlatformInterferer::interference(Nanoseconds window) const {
    if (cost <= Nanoseconds{0} || window <= Nanoseconds{0}) return Nanoseconds{0};
    QDUINO_EXPECT(interval > Nanoseconds{0} && jitter >= Nanoseconds{0});
    std::int64_t events = div_ceil((window + jitter).count(), interval.count());
    if (peak_interval > Nanoseconds{0})
        events = std::min(events, div_ceil((window + peak_jitter).count(), peak_interval.count()));
    return events * cost;
}

Nanoseconds PlatformOverheads::interference(Nanoseconds window) const {
    Nanoseconds sum{0};
    for (const PlatformInterferer& interferer : interferers) sum += interferer.interference(window);
    return sum;
}

/// Each interferer comes at least `interval` apart, and up to `jitter` closer. So in any window
/// neither of two comes more often than one with the shorter interval and the longer jitter.
void PlatformOverheads::add(const PlatformInterferer& interferer) {
    if (interferer.cost <= Nanoseconds{0}) return;
    if (interferers.size() + 1 < interferers.kCapacity) return interferers.push_back(interferer);
    const auto distance = [&](const PlatformInterferer& each) {
        const auto [shorter, longer] = std::minmax(each.interval, interferer.interval);
        return longer / std::max(shorter, Nanoseconds{1});
    };
    PlatformInterferer& bears = *std::ranges::min_element(interferers, {}, distance);
    bears.name = FixedString<23>{"several"};  // it is no longer any one of them
    bears.cost += interferer.cost;
    bears.interval = std::min(bears.interval, interferer.interval);
    bears.jitter = std::max(bears.jitter, interferer.jitter);
    bears.peak_interval = bears.peak_jitter = Nanoseconds{0};
}

PlatformOverheads CoreLoad::all_overheads() const {
    PlatformOverheads all = overheads;
    for (const Vcpu& io : ios)
        all.add({.name = "edges", .cost = io.edge_cost, .interval = io.edge_interval, .source = io.id});
    return all;
}

Nanoseconds CoreLoad::allowance_of(const Vcpu& loop) const {
    if (!overheads.victim_pays) return Nanoseconds{0};
    return std::min(all_overheads().interference(loop.period), loop.period - loop.budget);
}

}  // namespace qduino::sched
