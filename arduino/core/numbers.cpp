#include "arduino/core/numbers.h"

#include <atomic>

namespace {

// SplitMix64 (Steele, Lea, Flood, OOPSLA 2014): a counter and a mixing function, so that drawing a
// number is one atomic addition.
constexpr std::uint64_t kGamma = 0x9e3779b97f4a7c15;
std::atomic<std::uint64_t> random_state{1};

std::uint64_t next_random() {
    std::uint64_t z = random_state.fetch_add(kGamma, std::memory_order_relaxed) + kGamma;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
    return z ^ (z >> 31);
}

}  // namespace

void randomSeed(unsigned long seed) {
    if (seed != 0) random_state.store(seed, std::memory_order_relaxed);
}

std::int64_t qduino::arduino::random_between(std::int64_t low, std::int64_t high) {
    if (low >= high) return low;
    const std::uint64_t span = static_cast<std::uint64_t>(high) - static_cast<std::uint64_t>(low);
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(low) + next_random() % span);
}
