// VCPUs that name no core, onto cores: a packing problem, which has no quick exact answer.
//
// First fit by decreasing utilisation is quick, and gives up on sets that fit when the cores are
// nearly full. Several ways are tried, each bounded, the quick ones first:
//
//   greedy in three orders, each onto the first, the fullest or the emptiest core that takes it
//   exchange what is left over takes the place of a smaller one, which is then left over; the
//               smaller it is, the more cores can take it
//   search      every distribution in depth-first order, as far as kQuestions allow
//
// The order "harmonic" puts periods together that nearly divide each other: such loops fill a core
// (A. Burchard et al., "New strategies for assigning real-time tasks to multiprocessor systems",
// IEEE Trans. Computers, 1995).
#pragma once

#include <array>
#include <span>

#include "base/fixed_vector.h"
#include "sched/load.h"
#include "sched/placement.h"

namespace qduino::sched {

class Partition {
  public:
    /// `loads`: what is on the cores already, which stays there. Contract: both outlive it.
    Partition(std::span<const Vcpu> requests, FixedVector<CoreLoad, kCoreLimit>& loads);

    /// Puts every request that names no core on one. False: nothing was found. Then the loads are
    /// as they were, or, where waits for locks of other cores alone are in the way, one attempt
    /// stays.
    [[nodiscard]] bool place();
    /// After place() was false: what the first way that was tried could not place; null: there is
    /// an attempt that places all.
    [[nodiscard]] const Vcpu* left_over() const { return stayed_ ? nullptr : &requests_[first_left_over_]; }

  private:
    enum class Order : std::uint8_t { utilisation, harmonic, period };
    enum class Fit : std::uint8_t { first, fullest, emptiest };
    using Index = std::size_t;  // of requests_
    static constexpr int kQuestions = 1500;
    static constexpr int kExchanges = 24;

    void sort(Order order);
    [[nodiscard]] bool greedy(Fit fit);
    [[nodiscard]] bool fits_together();
    [[nodiscard]] bool put(Index i, Fit fit);
    [[nodiscard]] bool put_on(CoreLoad& load, Index i);
    [[nodiscard]] bool exchange(Index& left_over);
    [[nodiscard]] bool takes_the_place(CoreLoad& load, Index i, Index smaller);
    [[nodiscard]] bool search(std::size_t from);
    void take(CoreLoad& load, Index i) const;
    void clear();
    [[nodiscard]] double utilisation(Index i) const;
    void sort_cores(Fit fit);

    std::span<const Vcpu> requests_;
    FixedVector<CoreLoad, kCoreLimit>& loads_;
    FixedVector<Index, kRequestLimit> list_;          // in the order of the present way
    FixedVector<CoreLoad*, kCoreLimit> cores_;        // likewise
    std::array<CoreLoad*, kRequestLimit> core_of_{};  // null: not placed
    std::array<double, kCoreLimit> filled_{};         // by core number
    int questions_ = 0;
    Index first_left_over_ = 0;
    bool stayed_ = false;
};

}  // namespace qduino::sched
