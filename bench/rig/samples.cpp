#include "bench/rig/samples.h"

#include <sys/mman.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace qduino::bench {

SharedSamples::SharedSamples(std::size_t capacity) : capacity_(capacity) {
    const std::size_t bytes = sizeof(std::int64_t) * (capacity + 8);
    void* memory =
        ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
    if (memory == MAP_FAILED) {
        std::perror("memory for the samples");
        std::exit(1);
    }
    memory_ = board::linux::Mapping{memory, bytes};
    head_ = new (memory) Head{};
    values_ = static_cast<std::int64_t*>(memory) + 8;  // a cache line after the count
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
