// Blocking: how long a loop can be kept from running by loops of lower priority, because of locks.
//
// A loop that waits for a lock waits for its holder. Priority inheritance keeps loops of middle
// priority out of that wait, and so bounds it: a release waits for each lower loop at most once,
// and for each lock at most once. So it is blocked for no longer than the smaller of
//
//   Σ over lower loops of the longest section that can block it
//   Σ over the locks that can block it, of the longest section of a lower loop
//
// L. Sha, R. Rajkumar, J. Lehoczky, "Priority inheritance protocols", IEEE Trans. Computers, 1990
// (theorem 6). A lock can block a loop when that loop or one of higher priority takes it; and so
// can a lock that a lower loop takes while it holds one of these, a chain:
//
//   loop 1  needs A ──► held by loop 2, which needs B ──► held by loop 3
//
// That order is not known here, so a loop that takes two locks is taken to hold both at once.
// A release that also sleeps can be blocked again after each sleep.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "base/fixed_vector.h"
#include "base/time.h"
#include "sched/vcpu.h"

namespace qduino::sched {

/// `loop` holds `lock` for at most `length` of its CPU time, sections inside included.
struct CriticalSection {
    VcpuId loop = 0;
    std::uint8_t lock = 0;  ///< below kLockLimit
    Nanoseconds length{};
};

inline constexpr std::size_t kLockLimit = 32;  ///< locks that admission tells apart
using CriticalSections = FixedVector<CriticalSection, 128>;

/// The blocking of every loop of one core.
class Blocking {
  public:
    /// `by_rank`: the loops of the core, at most kMainVcpuLimit, highest priority first. Sections
    /// of other loops do not count.
    Blocking(std::span<const VcpuId> by_rank, std::span<const CriticalSection> sections);

    /// How long a release of loop `by_rank[i]` can be blocked.
    [[nodiscard]] Nanoseconds of(std::size_t i) const;

  private:
    using Locks = std::uint32_t;  // a bit each
    [[nodiscard]] Locks that_block(std::size_t i) const;

    std::size_t loops_;
    std::array<Locks, kMainVcpuLimit> locks_of_{};
    std::array<std::array<Nanoseconds, kLockLimit>, kMainVcpuLimit> longest_{};
};

}  // namespace qduino::sched
