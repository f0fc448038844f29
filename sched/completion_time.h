// Completion-time analysis of one core: the least R of each loop i that satisfies
//
//   R = C_i + S_i + B_i + V_i + Σ_{j in hp(i)} ⌈(R + J_j)/T_j⌉·C_j
//           + Σ_{k in I/O} max_{q in hep(i)} (1 + ⌈(R − U_k·T_q)/T_q⌉)·U_k·T_q  +  platform(R)
//           + (1 + sleeps)·late
//
// C     budget, what an activation and each further wait costs (admission.h), and the waits for
//       handlers that hold a lock (blocking.h). Of others: with what they have beside the budget
//       to pay for interrupts (CoreLoad::allowance_of())
// S     the longest that a release sleeps, counted as if it computed meanwhile
// B     blocking by lower loops (blocking.h); after each sleep, and after each wait for another
//       core, it can come again
// V     waits for locks that loops of other cores hold (remote_blocking.h)
// J     T − C of a loop whose budget may be used late in one period and early in the next
//       (deferrable_server.h), else `late`
// late  how late a loop wakes (PlatformOverheads::wake_latency)
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
// nearly full. Loop after loop, it starts at what the last one's R says: what delays loop i delays
// the next one, and loop i itself does, once at least (M. Sjödin, H. Hansson, RTSS 1998). Where it
// would still take more than kSteps, R is replaced by a bound on it: each ⌈x⌉ is below x + 1, which
// makes the equation linear (E. Bini et al., RTSS 2009).
#pragma once

#include <array>
#include <optional>
#include <span>

#include "sched/exact.h"
#include "sched/load.h"
#include "sched/verdict.h"

namespace qduino::sched {

/// The budget of one service of `io` for a client of `period`, where an activation costs
/// `overhead`.
[[nodiscard]] Nanoseconds service_of(const Vcpu& io, Nanoseconds period, Nanoseconds overhead);

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
    /// Of bottom half `k`, in the order of the load, when it works for the loop of the shortest
    /// period, or for the client that it names. Contract: there is a loop.
    [[nodiscard]] IoResponse io_verdict(std::size_t k) const;
    /// Each R <= T?
    [[nodiscard]] bool every_loop_meets() const;
    /// Of each loop, highest first, with R followed up to kResponseLimit·T.
    [[nodiscard]] FixedVector<LoopResponse, kMainVcpuLimit> verdicts() const;
    /// The shares of `window` from the release of loop `i` on: its own budget, each VCPU of higher
    /// priority, each I/O VCPU, the platform. In a window of length R the sum is R.
    [[nodiscard]] Shares shares(std::size_t i, Nanoseconds window) const;
    /// For so long, at least, loop i could be held up besides, and still end in time.
    [[nodiscard]] Nanoseconds room(std::size_t i) const;
    /// A release of the loop `id` is later by each further piece of its sleep.
    [[nodiscard]] bool blocks_after_each_sleep(VcpuId id) const;
    /// The loops leave less than the system keeps for ordinary tasks: what it keeps is counted.
    [[nodiscard]] bool keeps_for_others() const { return keeps_for_others_; }

  private:
    static constexpr int kSteps = 400, kStepsToAsk = 12;
    /// What is worked out once of a bottom half.
    struct Io {
        Divisor named_client;
        std::int64_t share = 0;
        double most_per_time = 0;  // of U_k·T_q/T_q, rounded up
        // U_k·T_q, by q.
        std::array<Nanoseconds, kMainVcpuLimit> budgets{};
    };
    void prepare(const Vcpu& vcpu, Io& io) const;
    /// `services` of `budget` each.
    struct IoDemand {
        std::int64_t services = 0;
        Nanoseconds budget{};
    };
    [[nodiscard]] Nanoseconds own_cost(std::size_t i) const {
        return loops_[i].budget + activation_[i] + by_handlers_[i];
    }
    /// For others.
    [[nodiscard]] Nanoseconds cost(std::size_t j) const { return own_cost(j) + allowance_[j]; }
    [[nodiscard]] std::int64_t releases(std::size_t j, Nanoseconds window) const {
        return periods_[j].ceil(window + jitter(j));
    }
    [[nodiscard]] IoDemand worst_io_demand(std::size_t k, std::size_t i, Nanoseconds window) const;
    /// The first `count` loops, the bottom halves and the platform, for a loop of the rank of i,
    /// but not `itself`.
    [[nodiscard]] Nanoseconds taken_by_others(std::size_t count, std::size_t i, Nanoseconds window,
                                              const Vcpu* itself) const;
    [[nodiscard]] Nanoseconds demand(std::size_t i, Nanoseconds window) const;
    void hold_up(const CoreLoad& load);
    void keep_for_others();
    /// Loop `i` has the lowest priority, and others may have it, too.
    [[nodiscard]] bool shares_priority(std::size_t i) const;
    /// The periods that I/O VCPU k may have when it delays loop `i`; of size(): all that it may
    /// have.
    [[nodiscard]] std::span<const Divisor> clients_of(std::size_t k, std::size_t i) const;
    /// How many of the loops can delay loop `i`: hp(i) are the first so many, without `i` itself.
    [[nodiscard]] std::size_t delaying(std::size_t i) const;
    [[nodiscard]] Nanoseconds jitter(std::size_t j) const;
    /// R of loop i, and what it is not below.
    struct Solution {
        Nanoseconds response{};
        Nanoseconds at_least{};
    };
    /// R; or whether there is one within the limit, which a bound on it may say sooner.
    enum class Wanted : std::uint8_t { response, whether };
    [[nodiscard]] Solution solve(std::size_t i, Nanoseconds limit, Nanoseconds at_least, Wanted wanted) const;
    /// What R of loop i + 1 is not below, when R of loop i is not below that.
    [[nodiscard]] Nanoseconds next_at_least(std::size_t i, Nanoseconds at_least) const;
    [[nodiscard]] std::optional<Nanoseconds> least_response(std::size_t count, std::size_t i,
                                                            Nanoseconds fixed, const Vcpu* itself) const;
    [[nodiscard]] std::optional<Nanoseconds> most_response(std::size_t i) const;

    FixedVector<Vcpu, kMainVcpuLimit> loops_;
    FixedVector<Vcpu, kIoVcpuLimit> ios_;
    PlatformOverheads overheads_;
    Nanoseconds overhead_{};  // of one activation
    std::size_t priorities_ = kMainVcpuLimit;
    bool keeps_for_others_ = false;
    std::array<Nanoseconds, kMainVcpuLimit> activation_{};   // and further waits
    std::array<Nanoseconds, kMainVcpuLimit> by_handlers_{};  // waits for their locks
    std::array<Nanoseconds, kMainVcpuLimit> allowance_{};    // for interrupts
    std::array<Nanoseconds, kMainVcpuLimit> late_{};         // wakes so late, all together
    std::array<Nanoseconds, kMainVcpuLimit> blocked_{};      // B
    std::array<Nanoseconds, kMainVcpuLimit> held_up_{};      // S + B + V + late
    std::array<Nanoseconds, kIoVcpuLimit> io_held_up_{};     // by locks of loops
    std::array<RemoteWaits, kMainVcpuLimit> waits_{};
    /// The distinct periods, shortest first: what an I/O VCPU's client may have. hep(i) has the
    /// first client_count_[i] of them.
    FixedVector<Divisor, kMainVcpuLimit> client_periods_;
    std::array<std::size_t, kMainVcpuLimit> client_count_{};
    std::array<Divisor, kMainVcpuLimit> periods_{};
    std::array<std::int64_t, kMainVcpuLimit> share_{};  // of the core, at the least
    std::array<Io, kIoVcpuLimit> io_{};
};

}  // namespace qduino::sched
