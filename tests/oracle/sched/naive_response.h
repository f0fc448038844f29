// The response time of a loop found without any analysis: release everything at once and watch,
// tick by tick. And the equation with I/O VCPUs solved by trying every R in turn.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace qduino::sched::oracle {

struct NaiveLoop {
    std::int64_t budget;
    std::int64_t period;
};

/// Loops in order of priority, all released at 0 and then periodically. The tick in which loop
/// `i`'s first job has ended, or limit + 1. (Liu, Layland, 1973: this is the worst case.)
inline std::int64_t watched_response(const std::vector<NaiveLoop>& loops, std::size_t i, std::int64_t limit) {
    std::vector<std::int64_t> left(i + 1, 0);
    left[i] = loops[i].budget;
    for (std::int64_t now = 0; now <= limit; ++now) {
        if (left[i] == 0) return now;
        for (std::size_t j = 0; j < i; ++j) {
            if (now % loops[j].period == 0) left[j] += loops[j].budget;
        }
        const auto runs = std::find_if(left.begin(), left.end(), [](std::int64_t work) { return work > 0; });
        if (runs != left.end()) --*runs;
    }
    return limit + 1;
}

inline std::int64_t divided_up(std::int64_t a, std::int64_t b) { return a <= 0 ? 0 : (a + b - 1) / b; }

inline std::int64_t service_for(std::int64_t client, const NaiveLoop& io) {
    return std::max<std::int64_t>(io.budget * client / io.period, 1);
}

/// What a bottom half takes in a window whose longest service is of `client`: that one, and its
/// share of the rest.
inline std::int64_t naive_io(const NaiveLoop& io, std::int64_t client, std::int64_t window) {
    const std::int64_t share = service_for(client, io);
    return share + divided_up((window - share) * io.budget, io.period);
}

/// Right side of the equation for loop `i`, term by term; U·T rounded up as the analysis does.
inline std::int64_t naive_demand(const std::vector<NaiveLoop>& loops, const std::vector<NaiveLoop>& ios,
                                 std::size_t i, std::int64_t window) {
    std::int64_t sum = loops[i].budget;
    for (std::size_t j = 0; j < i; ++j) sum += divided_up(window, loops[j].period) * loops[j].budget;
    for (const NaiveLoop& io : ios) {
        std::int64_t worst = 0;
        for (std::size_t q = 0; q < i && loops[q].period < loops[i].period; ++q)
            worst = std::max(worst, naive_io(io, loops[q].period, window));
        sum += worst;
    }
    return sum;
}

/// The same for a service of bottom half `k` for a client of `client`.
inline std::int64_t naive_service_demand(const std::vector<NaiveLoop>& loops,
                                         const std::vector<NaiveLoop>& ios, std::size_t k,
                                         std::int64_t client, std::int64_t window) {
    std::int64_t sum = service_for(client, ios[k]);
    for (const NaiveLoop& loop : loops) {
        if (loop.period <= client) sum += divided_up(window, loop.period) * loop.budget;
    }
    for (std::size_t other = 0; other < ios.size(); ++other) {
        if (other != k) sum += naive_io(ios[other], client, window);
    }
    return sum;
}

/// Least R >= 1 with demand(R) <= R, or limit + 1.
inline std::int64_t solved_response(const std::vector<NaiveLoop>& loops, const std::vector<NaiveLoop>& ios,
                                    std::size_t i, std::int64_t limit) {
    for (std::int64_t r = 1; r <= limit; ++r) {
        if (naive_demand(loops, ios, i, r) <= r) return r;
    }
    return limit + 1;
}

}  // namespace qduino::sched::oracle
