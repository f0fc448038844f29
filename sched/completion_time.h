// Completion-time analysis of one core: the least R of each loop i that satisfies
//
//   R = C_i + S_i + B_i + Σ_{j in hp(i)} ⌈(R + J_j)/T_j⌉·C_j
//           + Σ_{k in I/O} max_{q in hep(i)} (1 + ⌈(R − U_k·T_q)/T_q⌉)·U_k·T_q  +  platform(R)
//
// C     budget, and what an activation costs (admission.h)
// S     the longest that a release sleeps, counted as if it computed meanwhile
// B     blocking by lower loops (blocking.h); after each sleep it can come again
// J     T − C of a loop whose budget may be used late in one period and early in the next
//       (deferrable_server.h), else 0
// hp    loops of higher priority, and those that share the loop's priority
// U·T   at least what an activation costs: a bottom half pays for its activations out of its own
//       budget (pibs.h)
//
// Joseph, Pandya, Computer Journal 1986; S and J: N. Audsley et al., Software Engineering Journal,
// 1993, and J.-J. Chen et al., "Many suspensions, many problems", Real-Time Systems, 2019; the I/O
// term: Missimer, Missimer, West, ECRTS 2016. All in integers; U·T rounded up.
//
// Fixed-point iteration from below. It starts at C/(1 − U_hp), which R cannot be under because R >=
// C + R·U_hp (Davis, Zabos, Burns, IEEE ToC 2008); that saves most of the way when the core is
// nearly full. Where it would still take more than kSteps, R is replaced by a bound on it: each ⌈x⌉
// is below x + 1, which makes the equation linear (E. Bini et al., RTSS 2009).
#pragma once

#include <array>
#include <optional>
#include <span>

#include "sched/load.h"
#include "sched/verdict.h"

namespace qduino::sched {

/// The analysis of one load; keeps tables, not the load. About 12 KB: fit for a stack at set-up.
class CompletionTime {
  public:
    /// Contract: every VCPU of `load` has valid parameters.
    explicit CompletionTime(const CoreLoad& load);

    /// Loops by priority, highest first.
    [[nodiscard]] std::size_t size() const { return loops_.size(); }
    [[nodiscard]] const Vcpu& loop(std::size_t i) const { return loops_[i]; }
    [[nodiscard]] Nanoseconds period(std::size_t i) const { return loops_[i].period; }

    /// R of loop `i` if it is at most `limit`, else some value beyond `limit`.
    [[nodiscard]] Nanoseconds response(std::size_t i, Nanoseconds limit) const;
    /// The same as a verdict, R followed up to kResponseLimit·T.
    [[nodiscard]] LoopResponse verdict(std::size_t i) const;
    /// Of bottom half `k`, in the order of the load, when it works for the loop of the shortest
    /// period, or for the client that it names. Contract: there is a loop.
    [[nodiscard]] IoResponse io_verdict(std::size_t k) const;
    /// Each R <= T?
    [[nodiscard]] bool every_loop_meets() const;
    /// The shares of `window` from the release of loop `i` on: its own budget, each VCPU of higher
    /// priority, each I/O VCPU, the platform. In a window of length R the sum is R.
    [[nodiscard]] Shares shares(std::size_t i, Nanoseconds window) const;

  private:
    static constexpr int kSteps = 400;
    /// `services` of `budget` each.
    struct IoDemand {
        std::int64_t services = 0;
        Nanoseconds budget{};
    };
    [[nodiscard]] Nanoseconds cost(std::size_t j) const { return loops_[j].budget + overhead_; }
    [[nodiscard]] std::int64_t releases(std::size_t j, Nanoseconds window) const;
    [[nodiscard]] IoDemand worst_io_demand(std::size_t k, std::size_t i, Nanoseconds window) const;
    [[nodiscard]] Nanoseconds demand(std::size_t i, Nanoseconds window) const;
    void hold_up(const CriticalSections& sections);
    void keep_for_others();
    /// Loop `i` has the lowest priority, and others may have it, too.
    [[nodiscard]] bool shares_priority(std::size_t i) const;
    /// The periods that I/O VCPU k may have when it delays loop `i`; of size(): all that it may
    /// have.
    [[nodiscard]] std::span<const Nanoseconds> clients_of(std::size_t k, std::size_t i) const;
    /// How many of the loops can delay loop `i`: hp(i) are the first so many, without `i` itself.
    [[nodiscard]] std::size_t delaying(std::size_t i) const;
    [[nodiscard]] Nanoseconds jitter(std::size_t j) const;
    [[nodiscard]] std::optional<Nanoseconds> least_response(std::size_t i) const;
    [[nodiscard]] std::optional<Nanoseconds> most_response(std::size_t i) const;

    FixedVector<Vcpu, kMainVcpuLimit> loops_;
    FixedVector<Vcpu, kIoVcpuLimit> ios_;
    PlatformOverheads overheads_;
    Nanoseconds overhead_{};  // of one activation
    std::size_t priorities_ = kMainVcpuLimit;
    std::array<Nanoseconds, kMainVcpuLimit> held_up_{};  // S + B
    /// The distinct periods, shortest first: what an I/O VCPU's client may have. hep(i) has the
    /// first client_count_[i] of them.
    FixedVector<Nanoseconds, kMainVcpuLimit> client_periods_;
    std::array<std::size_t, kMainVcpuLimit> client_count_{};
    // U_k·T_q, by k and q.
    std::array<std::array<Nanoseconds, kMainVcpuLimit>, kIoVcpuLimit> io_budgets_{};
};

}  // namespace qduino::sched
