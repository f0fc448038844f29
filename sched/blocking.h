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
//
// A handler (an I/O VCPU) that holds a lock may have no budget left, however high it ranks: then a
// loop waits for it as for a lower one. It may be served again before the loop asks once more, so
// this can happen at each request. And a handler that waits may rank above any loop: what a lower
// loop locks with it delays all those between.
//
//   loop 1   ██ lock ░░░░░░░░████             ░ waits for the rest of the handler's section
//   io 33  ██(lock)··········                 · no budget; goes on at the rank of loop 1: ▒
//                    ▒▒▒▒▒▒▒▒
//
// Its server pays for that, out of the budgets to come, for no longer than its sections say.
//
// A loop that keeps to its budget has it until its release ends: its server begins at the nominal
// release, whatever delays the wake-up, and a wait for a lock delays no refill. So no such loop
// lacks budget while it holds a lock, and R has no term for it. One that has computed more than it
// declares may. Then its waiters pay (core_scheduler.h), which share the lock with it, and nobody
// else is later by it. (The alternatives cost honest loops more. A holder that overran and paid
// later would delay all below it by its sections, a term in each R. One that may lock only while
// its budget covers its section, M. Behnam et al., "SIRAP", EMSOFT 2007, would wait for a period
// where the section is in fact shorter than its bound.)
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "base/fixed_vector.h"
#include "base/time.h"
#include "sched/vcpu.h"

namespace qduino::sched {

/// `loop` (or an I/O VCPU) holds `lock` for at most `length` of its CPU time, sections inside
/// included.
struct CriticalSection {
    VcpuId loop = 0;
    std::uint8_t lock = 0;  ///< below kLockLimit
    Nanoseconds length{};
    /// Nobody said who holds this lock: every loop of a core may, and no two cores share it. A wait
    /// for it is paid for by the waiter's own budget.
    bool assumed = false;
};

inline constexpr std::size_t kLockLimit = 32;  ///< locks that admission tells apart
using CriticalSections = FixedVector<CriticalSection, 256>;

using LockSet = std::uint32_t;  ///< a bit each

/// All locks that a chain from `locks` may reach: who takes one of them may hold its others at the
/// same time. `each_holder(visit)` calls `visit` with the LockSet of each that counts.
template <typename EachHolder>
[[nodiscard]] LockSet chained_with(LockSet locks, EachHolder each_holder) {
    for (LockSet before = 0; before != locks;) {
        before = locks;
        each_holder([&locks](LockSet held) {
            if (held & locks) locks |= held;
        });
    }
    return locks;
}

/// How long `holder` may run without budget, because somebody waits for a lock that it holds: all
/// its sections under locks that another VCPU takes.
[[nodiscard]] Nanoseconds longest_overrun(std::span<const CriticalSection> sections, VcpuId holder);

/// How often a release of `loop` asks for locks that somebody said it takes.
[[nodiscard]] int requests_of(std::span<const CriticalSection> sections, VcpuId loop);

/// The blocking of every loop of one core.
class Blocking {
  public:
    /// `by_rank`: the loops of the core, at most kMainVcpuLimit, highest priority first;
    /// `handlers`: its I/O VCPUs. Sections of others do not count.
    Blocking(std::span<const VcpuId> by_rank, std::span<const CriticalSection> sections,
             std::span<const VcpuId> handlers = {});

    /// How long a release of loop `by_rank[i]` can be blocked by lower loops.
    [[nodiscard]] Nanoseconds of(std::size_t i) const;
    /// How long it can wait for handlers, in all its requests together.
    [[nodiscard]] Nanoseconds by_handlers(std::size_t i) const;
    /// How long one service of I/O VCPU `handler` can wait for loops.
    [[nodiscard]] Nanoseconds of_handler(VcpuId handler) const;

  private:
    [[nodiscard]] LockSet that_block(std::size_t i) const;
    [[nodiscard]] LockSet connected_with(LockSet locks) const;

    std::size_t loops_;
    std::array<LockSet, kMainVcpuLimit> locks_of_{};
    std::array<int, kMainVcpuLimit> requests_{};
    std::array<std::array<Nanoseconds, kLockLimit>, kMainVcpuLimit> longest_{};
    struct Handler {
        VcpuId id = 0;
        LockSet locks = 0;
    };
    FixedVector<Handler, kIoVcpuLimit> handlers_;
    std::array<Nanoseconds, kLockLimit> by_handlers_{};
};

}  // namespace qduino::sched
