// The refills of a sporadic server: a bounded, ordered list of {time, amount} that always sums to
// the budget.
//
// A refill {t, a} is a run of a unit tokens (1 ns each): the k-th may be spent from t + k on. That
// reading gives every operation its meaning, and the naive oracle of the tests is exactly that list
// of tokens:
//
//   {10, 3} {20, 2}   =   tokens at 10 11 12 . . . . . . . 20 21
//
//   spend(u)       the first u tokens move one period later, also those not yet due: never forgiven
//   advance(now)   the k-th token moves to now + k if it was earlier: idling saves up nothing
//   touching runs  {10, 3} {13, 2} are one run {10, 5}: the same tokens, nothing changes
//   list full      the last run is delayed until it touches the new one: a merge advances no token
//
// Source: M. Stanovich, T. Baker, A.-I. Wang, M. Gonzalez Harbour, "Defects of the POSIX sporadic
// server and how to correct them", RTAS 2010, which mends B. Sprunt, "Aperiodic task scheduling for
// real-time systems", 1990.
//
// Invariants, checked around every operation:
// 1. Σ amount == total, always; every amount > 0; 1 <= size <= limit.
// 2. times strictly increase, and neighbours do not touch: time[i] + amount[i] < time[i+1].
// 3. the tokens span at most one period: time[last] + amount[last] <= time[0] + period.
#pragma once

#include <cstddef>
#include <span>

#include "base/fixed_vector.h"
#include "base/time.h"

namespace qduino::sched {

struct Refill {
    Instant time{};        ///< spendable from here on
    Nanoseconds amount{};  ///< > 0

    /// The end of a run that is spent from `time` on without a pause.
    [[nodiscard]] constexpr Instant end() const { return time + amount; }
    constexpr bool operator==(const Refill&) const = default;
};

/// Any one owner at a time; wait-free, O(size).
class RefillQueue {
  public:
    static constexpr std::size_t kCapacity = 16;

    RefillQueue() = default;  ///< for containers only: holds nothing until assigned
    /// One refill {start, total}. Contract: 0 < total, 1 <= limit <= kCapacity.
    RefillQueue(Instant start, Nanoseconds total, std::size_t limit = kCapacity);

    /// The earliest refill. Contract: not a default-constructed queue.
    [[nodiscard]] const Refill& head() const { return refills_.front(); }
    /// CPU time that may be used from `now` on without a pause: the due tokens, and those that fall
    /// due meanwhile.
    [[nodiscard]] Nanoseconds contiguous_from(Instant now) const;

    /// The first `used` tokens become spendable one `period` later than they were.
    /// Contract: used >= 0, total <= period.
    void spend(Nanoseconds used, Nanoseconds period);
    /// No token may be spent before `now` any more. Those that have waited become one run from
    /// `now` on.
    void advance(Instant now);
    /// Delays runs at the head that are shorter than `shortest` until they touch the next one.
    void join_splinters(Nanoseconds shortest);
    /// Delays the run at the head until it touches the next one, while less than `shortest` lies
    /// between them.
    void close_gaps(Nanoseconds shortest);

    [[nodiscard]] Nanoseconds total() const;
    [[nodiscard]] std::span<const Refill> refills() const { return {refills_.begin(), refills_.size()}; }

  private:
    void append(Refill later);
    void delay_head();
    void check(Nanoseconds total_before) const;

    FixedVector<Refill, kCapacity> refills_;
    std::size_t limit_ = kCapacity;
};

}  // namespace qduino::sched
