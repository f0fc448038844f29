// Completion-time analysis of one core: the least R of each loop i that satisfies
//
//   R = C_i + Σ_{j in hp(i)} ⌈R/T_j⌉·C_j
//           + Σ_{k in I/O} max_{q in hep(i)} (1 + ⌈(R − U_k·T_q)/T_q⌉)·U_k·T_q  +  platform(R)
//
// with every C and every U·T longer by what an activation costs (admission.h). Joseph, Pandya,
// Computer Journal 1986; the I/O term: Missimer, Zhao, West, ECRTS 2016. All in integers; U·T
// rounded up.
//
// Fixed-point iteration from below. It starts at C/(1 − U_hp), which R cannot be under because R >=
// C + R·U_hp (Davis, Zabos, Burns, IEEE ToC 2008); that saves most of the way when the core is
// nearly full.
#pragma once

#include <array>
#include <optional>

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
    /// Each R <= T?
    [[nodiscard]] bool every_loop_meets() const;
    /// The shares of `window` from the release of loop `i` on: its own budget, each VCPU of higher
    /// priority, each I/O VCPU, the platform. In a window of length R the sum is R.
    [[nodiscard]] Shares shares(std::size_t i, Nanoseconds window) const;

  private:
    /// `services` of `budget` each.
    struct IoDemand {
        std::int64_t services = 0;
        Nanoseconds budget{};
    };
    [[nodiscard]] Nanoseconds cost(std::size_t j) const { return loops_[j].budget + overhead_; }
    [[nodiscard]] std::int64_t releases(std::size_t j, Nanoseconds window) const;
    [[nodiscard]] Nanoseconds total(const IoDemand& demand) const;
    [[nodiscard]] IoDemand worst_io_demand(std::size_t k, std::size_t i, Nanoseconds window) const;
    [[nodiscard]] Nanoseconds demand(std::size_t i, Nanoseconds window) const;
    [[nodiscard]] std::optional<Nanoseconds> least_response(std::size_t i) const;

    FixedVector<Vcpu, kMainVcpuLimit> loops_;
    FixedVector<Vcpu, kIoVcpuLimit> ios_;
    PlatformOverheads overheads_;
    Nanoseconds overhead_{};  // of one activation
    /// The distinct periods, shortest first: what an I/O VCPU's client may have. hep(i) has the
    /// first client_count_[i] of them.
    FixedVector<Nanoseconds, kMainVcpuLimit> client_periods_;
    std::array<std::size_t, kMainVcpuLimit> client_count_{};
    // U_k·T_q, by k and q.
    std::array<std::array<Nanoseconds, kMainVcpuLimit>, kIoVcpuLimit> io_budgets_{};
};

}  // namespace qduino::sched
