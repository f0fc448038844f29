#include "sched/blocking.h"

#include <algorithm>

#include "base/contract.h"

namespace qduino::sched {

Blocking::Blocking(std::span<const VcpuId> by_rank, std::span<const CriticalSection> sections)
    : loops_(by_rank.size()) {
    QDUINO_EXPECT(loops_ <= kMainVcpuLimit);
    for (const CriticalSection& section : sections) {
        const auto place = std::find(by_rank.begin(), by_rank.end(), section.loop);
        if (place == by_rank.end()) continue;
        const auto i = static_cast<std::size_t>(place - by_rank.begin());
        locks_of_[i] |= Locks{1} << section.lock;
        longest_[i][section.lock] = std::max(longest_[i][section.lock], section.length);
    }
}

/// The locks of loop i and of those above it, and those at the end of a chain from there.
Blocking::Locks Blocking::that_block(std::size_t i) const {
    Locks locks = 0;
    for (std::size_t j = 0; j <= i; ++j) locks |= locks_of_[j];
    for (Locks before = 0; before != locks;) {
        before = locks;
        for (std::size_t j = i + 1; j < loops_; ++j) {
            if (locks_of_[j] & locks) locks |= locks_of_[j];
        }
    }
    return locks;
}

Nanoseconds Blocking::of(std::size_t i) const {
    const Locks locks = that_block(i);
    Nanoseconds by_loop{};
    std::array<Nanoseconds, kLockLimit> of_lock{};
    for (std::size_t j = i + 1; j < loops_; ++j) {
        Nanoseconds of_loop{};
        for (std::size_t lock = 0; lock < kLockLimit; ++lock) {
            if (!(locks >> lock & 1)) continue;
            of_loop = std::max(of_loop, longest_[j][lock]);
            of_lock[lock] = std::max(of_lock[lock], longest_[j][lock]);
        }
        by_loop += of_loop;
    }
    Nanoseconds by_lock{};
    for (const Nanoseconds length : of_lock) by_lock += length;
    return std::min(by_loop, by_lock);
}

}  // namespace qduino::sched
