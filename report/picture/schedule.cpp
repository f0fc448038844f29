#include "report/picture/schedule.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace qduino::apps::picture {

void put_in_order(Schedule& schedule) {
    for (Core& core : schedule.cores) {
        std::ranges::sort(core.rows, {}, [](const Row& row) { return std::tuple(row.period, row.id); });
    }
    std::erase_if(schedule.cores, [](const Core& core) { return core.rows.empty() && core.taken.empty(); });
    std::ranges::sort(schedule.cores, {}, &Core::number);
}

std::size_t row_count(const Schedule& schedule) {
    std::size_t count = 0;
    for (const Core& core : schedule.cores) count += core.rows.size();
    return count;
}

bool anything_ran(const Schedule& schedule) {
    for (const Core& core : schedule.cores) {
        for (const Row& row : core.rows) {
            if (std::ranges::any_of(row.stretches, [](const Stretch& s) { return s.doing == Doing::runs; }))
                return true;
        }
    }
    return false;
}

Schedule window_of_pins(const Schedule& schedule) {
    Schedule window;
    window.from = schedule.from;
    window.until = schedule.pins_until;
    return window;
}

Nanoseconds good_length(const std::vector<sched::Vcpu>& vcpus) {
    constexpr std::int64_t kMost = 200;
    Nanoseconds longest{0}, shortest = Nanoseconds::max(), longest_owner{0};
    for (const sched::Vcpu& vcpu : vcpus) {
        if (vcpu.budget == vcpu.period) {
            longest_owner = std::max(longest_owner, vcpu.period);
            continue;
        }
        longest = std::max(longest, vcpu.period);
        shortest = std::min(shortest, vcpu.period);
    }
    if (longest == Nanoseconds{0}) return longest_owner > Nanoseconds{0} ? 20 * longest_owner : 1s;
    return 2 * longest / shortest > kMost ? longest : 2 * longest;
}

Share share_of(const Schedule& schedule, Instant from, Instant until) {
    const auto length = static_cast<double>((schedule.until - schedule.from).count());
    const auto at = [&](Instant t) {
        const Instant within = std::clamp(t, schedule.from, schedule.until);
        return static_cast<double>((within - schedule.from).count()) / length;
    };
    return {at(from), at(until)};
}

std::vector<double> filled(const Schedule& schedule, const Row& row, Doing doing, int columns) {
    std::vector<double> share(static_cast<std::size_t>(columns));
    for (const Stretch& stretch : row.stretches) {
        if (stretch.doing != doing) continue;
        const Share part = share_of(schedule, stretch.from, stretch.until);
        const double from = part.from * columns, until = part.until * columns;
        for (auto column = static_cast<std::size_t>(from); column < share.size(); ++column) {
            const auto begin = static_cast<double>(column);
            if (begin >= until) break;
            share[column] += std::min(until, begin + 1) - std::max(from, begin);
        }
    }
    return share;
}

}  // namespace qduino::apps::picture
