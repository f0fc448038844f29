// Completion-time analysis of one core: the least R of each loop i that satisfies
//
//   R = C_i + S_i + B_i + V_i + Σ_{j in hp(i)} ⌈(R + J_j)/T_j⌉·C_j
//           + Σ_{k in I/O} (D_k + U_k·(R − D_k))  +  platform(R)  +  (1 + sleeps)·late
//
// C     budget, what an activation and each further wait costs (admission.h), and the waits for
//       handlers that hold a lock (blocking.h). The C of others also has what they have beside the
//       budget to pay for interrupts (CoreLoad::allowance_of())
// S     the longest that a release sleeps, counted as if it computed meanwhile
// B     blocking by lower loops (blocking.h); after each sleep, and after each wait for another
//       core, it can come again
// V     waits for locks that loops of other cores hold (remote_blocking.h)
// J     T − C of a loop whose budget may be used late in one period and early in the next
//       (deferrable_server.h), else `late`
// late  how late a loop wakes (PlatformOverheads::wake_latency)
// hp    loops of higher priority, and those that share the loop's priority
// D_k   the longest service of bottom half k that can delay loop i: U_k·T_q of the longest client
//       q that ranks above i. At one period the loop goes first, so T_q < T_i; where a lock lends
//       ranks, or ranks are not told apart, T_q <= T_i. 0: none. At least what an activation costs:
//       a bottom half pays for its activations out of its own budget (pibs.h)
//
// Joseph, Pandya, Computer Journal 1986; S and J: N. Audsley et al., Software Engineering Journal,
// 1993, and J.-J. Chen et al., "Many suspensions, many problems", Real-Time Systems, 2019.
//
// The I/O term. Look from the last instant t0 before the release at which nothing that ranks above
// loop i, or beside it, has work that it may do. A service that runs behind t0 may begin at t0 or
// later, and the next one may begin after it by what it used, divided by U. So all services but the
// last use U·(time from the first one's begin to the last one's), and the last one at most D:
// D + U·(R − D) in all, whatever holds them up. It is (2 − U)·U·T in one period (Danish, Li, West,
// RTAS 2011) and never more than the (1 + ⌈(R − U·T)/T⌉)·U·T of Missimer, Missimer, West, ECRTS
// 2016, which counts each service as a whole one. A service that is raised counts from there.
//
// What is promised to a bottom half: for whichever loop of its core it works, a service U·T that
// may begin ends within that loop's T. So it gets its share. R of such a service is the same
// equation: U·T for C, loops of the client's period and above, bottom halves of the client's rank.
// The paper's term has that in it, but for loops that may end late and begin early (J), and for
// locks. So a set that the paper's term admits is not refused for a service.
//
// All in integers; D rounded down, as pibs.h has it. Fixed-point iteration from below. It starts at
// C/(1 − U_hp), which R cannot be under because R >= C + R·U_hp (Davis, Zabos, Burns, IEEE ToC
// 2008); that saves most of the way when the core is nearly full. Loop after loop, it starts at
// what the last one's R says: what delays loop i delays the next one, and loop i itself does, once
// at least (M. Sjödin, H. Hansson, RTSS 1998). Where it would still take more than kSteps, R is
// replaced by a bound on it: each ⌈x⌉ is below x + 1, which makes the equation linear (E. Bini et
// al., RTSS 2009).
#pragma once

#include <algorithm>
#include <array>
#include <optional>

#include "sched/exact.h"
#include "sched/load.h"
#include "sched/verdict.h"

namespace qduino::sched {

/// The budget of one service of `io` for a client of `period`, where an activation costs
/// `overhead`. Rounded up, so that services of so much come no more often than once in `period`.
[[nodiscard]] Nanoseconds service_of(const Vcpu& io, Nanoseconds period, Nanoseconds overhead);
/// The same rounded down: what pibs.h gives it.
[[nodiscard]] Nanoseconds longest_service_of(const Vcpu& io, Nanoseconds period, Nanoseconds overhead);

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
    /// The verdict on bottom half `k`, in the order of the load, when it works for the loop of the
    /// shortest period, or for the client that it names. Contract: there is a loop.
    [[nodiscard]] IoResponse io_verdict(std::size_t k) const;
    /// Each R <= T?
    [[nodiscard]] bool every_loop_meets() const;
    /// The first bottom half, in the order of the load, of which a service for some client does not
    /// end within the client's period.
    struct LateService {
        std::size_t io = 0;
        Nanoseconds client{};
        Nanoseconds response{};  ///< as of io_verdict()
    };
    [[nodiscard]] std::optional<LateService> late_service() const;
    /// Each loop meets by the term of Missimer, West, too. What that admits is not refused for a
    /// late service.
    [[nodiscard]] bool meets_beside_whole_services() const;
    /// The verdict on each loop, highest first, with R followed up to kResponseLimit·T.
    [[nodiscard]] FixedVector<LoopResponse, kMainVcpuLimit> verdicts() const;
    /// The shares of `window` from the release of loop `i` on: its own budget, each VCPU of higher
    /// priority, each I/O VCPU, the platform. In a window of length R the sum is R.
    [[nodiscard]] Shares shares(std::size_t i, Nanoseconds window) const;
    /// The same from when a service of bottom half `k` for a client of `client` may begin.
    [[nodiscard]] Shares io_shares(std::size_t k, Nanoseconds client, Nanoseconds window) const;
    /// For so long, at least, loop i could be held up besides, and still end in time.
    [[nodiscard]] Nanoseconds room(std::size_t i) const;
    /// A release of the loop `id` is later by each further piece of its sleep.
    [[nodiscard]] bool blocks_after_each_sleep(VcpuId id) const;
    /// The loops leave less than the system keeps for ordinary tasks: what it keeps is counted.
    [[nodiscard]] bool keeps_for_others() const { return keeps_for_others_; }

  private:
    static constexpr int kSteps = 400, kStepsToAsk = 12;
    static constexpr std::size_t kNone = SIZE_MAX;
    /// What is worked out once of a bottom half.
    struct Io {
        Rate rate;
        std::int64_t share = 0;  // of the core, at the least
    };
    /// What goes before one that has a certain rank: the first so many loops, but not itself, and
    /// services of bottom halves.
    struct Level {
        Nanoseconds own{};  ///< what it needs itself, with what holds it up
        std::size_t loops = 0;
        std::size_t itself = kNone;                        ///< of the loops
        std::array<Nanoseconds, kIoVcpuLimit> services{};  ///< the longest, of each; 0: none
        std::size_t io_count = 0;                          ///< those that have any
    };
    [[nodiscard]] Nanoseconds own_cost(std::size_t i) const {
        return loops_[i].budget + activation_[i] + by_handlers_[i];
    }
    /// For others.
    [[nodiscard]] Nanoseconds cost(std::size_t j) const { return own_cost(j) + allowance_[j]; }
    [[nodiscard]] Level level_of(std::size_t i) const;
    /// The level of a service of bottom half `k` for `client`; kNone: no service of its own, beside
    /// all bottom halves.
    [[nodiscard]] Level level_of_service(std::size_t k, Nanoseconds client) const;
    /// Counts the bottom halves but for `itself`, when they work for clients of at most `longest`.
    void add_services(Level& level, Nanoseconds longest, std::size_t itself) const;
    [[nodiscard]] std::int64_t releases(std::size_t j, Nanoseconds window) const {
        return periods_[j].ceil(window + jitter(j));
    }
    [[nodiscard]] Nanoseconds io_demand(const Level& level, std::size_t k, Nanoseconds window) const {
        const Nanoseconds longest = level.services[k];
        return longest + io_[k].rate.ceil(std::max(window - longest, Nanoseconds{0}));
    }
    [[nodiscard]] Nanoseconds demand(const Level& level, Nanoseconds window) const;
    void hold_up(const CoreLoad& load);
    void keep_for_others();
    /// Loop `i` has the lowest priority, and others may have it, too.
    [[nodiscard]] bool shares_priority(std::size_t i) const;
    void push_services(Shares& shares, const Level& level, Nanoseconds window) const;
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
    [[nodiscard]] Solution solve(const Level& level, Nanoseconds limit, Nanoseconds at_least,
                                 Wanted wanted) const;
    [[nodiscard]] Nanoseconds service_response(std::size_t k, Nanoseconds client) const;
    /// What R of loop i + 1 is not below, when R of loop i is not below that.
    [[nodiscard]] Nanoseconds next_at_least(std::size_t i, Nanoseconds at_least) const;
    [[nodiscard]] std::optional<Nanoseconds> least_response(const Level& level) const;
    [[nodiscard]] std::optional<Nanoseconds> most_response(const Level& level) const;

    FixedVector<Vcpu, kMainVcpuLimit> loops_;
    FixedVector<Vcpu, kIoVcpuLimit> ios_;
    PlatformOverheads overheads_;
    Nanoseconds overhead_{};  // of one activation
    std::size_t priorities_ = kMainVcpuLimit + kIoVcpuLimit;
    bool keeps_for_others_ = false;
    std::array<Nanoseconds, kMainVcpuLimit> activation_{};   // and further waits
    std::array<Nanoseconds, kMainVcpuLimit> by_handlers_{};  // waits for their locks
    std::array<Nanoseconds, kMainVcpuLimit> allowance_{};    // for interrupts
    std::array<Nanoseconds, kMainVcpuLimit> late_{};         // wakes so late, all together
    std::array<Nanoseconds, kMainVcpuLimit> blocked_{};      // B
    std::array<Nanoseconds, kMainVcpuLimit> held_up_{};      // S + B + V + late
    std::array<Nanoseconds, kIoVcpuLimit> io_held_up_{};     // by locks of loops
    std::array<RemoteWaits, kMainVcpuLimit> waits_{};
    /// The loop goes before a bottom half of its period: no lock lends that one a rank, and none is
    /// shared.
    bool loops_go_first_ = false;
    /// The distinct periods, shortest first: what an I/O VCPU's client may have.
    FixedVector<Nanoseconds, kMainVcpuLimit> client_periods_;
    std::array<Divisor, kMainVcpuLimit> periods_{};
    std::array<std::int64_t, kMainVcpuLimit> share_{};  // of the core, at the least
    std::array<Io, kIoVcpuLimit> io_{};
};

}  // namespace qduino::sched
