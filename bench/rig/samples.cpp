#include "bench/rig/samples.h"
#include "posix/mapping.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace qduino::bench {

SharedSamples::SharedSamples(std::size_t capacity) : capacity_(capacity) {
    const std::size_t bytes = sizeof(std::int64_t) * (capacity + 8);
    auto memory = posix::map_anonymous(bytes);
    if (!memory) {
        std::fprintf(stderr, "%s\n", std::string{memory.error().message.view()}.c_str());
        std::exit(1);
    }
    memory_ = std::move(*memory);
    head_ = new (memory_.as<void>()) Head{};
    values_ = memory_.as<std::int64_t>() + 8;  // a cache line after the count
}

std::int64_t percentile(std::span<const std::int64_t> sorted, double q) {
    if (sorted.empty()) return 0;
    const double rank = std::ceil(q * static_cast<double>(sorted.size()));
    const std::size_t index = rank < 1 ? 0 : static_cast<std::size_t>(rank) - 1;
    return sorted[std::min(index, sorted.size() - 1)];
}

std::vector<std::int64_t> sorted_intervals(std::span<const std::int64_t> instants) {
    std::vector<std::int64_t> intervals;
    for (std::size_t i = 1; i < instants.size(); ++i) intervals.push_back(instants[i] - instants[i - 1]);
    std::sort(intervals.begin(), intervals.end());
    return intervals;
}

}  // namespace qduino::bench
