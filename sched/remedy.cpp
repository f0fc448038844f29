#include "sched/remedy.h"

#include <algorithm>

#include "sched/admission.h"
#include "sched/remote_blocking.h"

namespace qduino::sched {
namespace {

constexpr Nanoseconds kGrain = 1us;
constexpr std::size_t kLinearWork = 400'000;  // loops · VCPUs · steps
constexpr std::size_t kWaitsWork = 100;       // to count waits between cores as well

Vcpu* find(CoreLoad& load, VcpuId id) {
    for (Vcpu& main : load.mains) {
        if (main.id == id) return &main;
    }
    for (Vcpu& io : load.ios) {
        if (io.id == id) return &io;
    }
    return nullptr;
}

/// Least steps in (known_bad, known_good] for which `good` holds, if it holds from some point on.
template <typename Predicate>
std::int64_t bisect(std::int64_t known_bad, std::int64_t known_good, Predicate good) {
    while (known_good - known_bad > 1) {
        const std::int64_t middle = known_bad + (known_good - known_bad) / 2;
        (good(middle) ? known_good : known_bad) = middle;
    }
    return known_good;
}

/// One VCPU of a computer, to be changed until everything fits.
struct Trial {
    std::span<CoreLoad> loads;
    CoreLoad& load;
    Vcpu& vcpu;
    bool all_cores;  ///< locks cross cores: what changes here changes waits there

    [[nodiscard]] bool fits() const { return all_cores ? are_admissible(loads) : is_admissible(load); }
};

std::optional<Nanoseconds> least_budget_reduction(const Trial& trial) {
    const Nanoseconds budget = trial.vcpu.budget;
    const std::int64_t most = (budget - Nanoseconds{1}) / kGrain;
    const auto good = [&](std::int64_t steps) {
        trial.vcpu.budget = budget - steps * kGrain;
        return trial.fits();
    };
    if (most < 1 || !good(most)) return std::nullopt;
    return bisect(0, most, good) * kGrain;
}

std::optional<Nanoseconds> least_period_increase(const Trial& trial) {
    const Nanoseconds period = trial.vcpu.period;
    const std::int64_t most = std::min((kPeriodMax - period) / kGrain, 1000 * (period / kGrain + 1));
    const auto good = [&](std::int64_t steps) {
        trial.vcpu.period = period + steps * kGrain;
        return trial.fits();
    };
    std::int64_t bad = 0;
    const CoreLoad& load = trial.load;
    if (!load.ios.empty()) {
        const std::size_t of_core =
            (load.mains.size() + 1) * (load.mains.size() + load.ios.size()) * (1 + load.ios.size() / 4);
        const std::size_t step_work = of_core * (trial.all_cores ? kWaitsWork : 1);
        const std::int64_t steps = static_cast<std::int64_t>(kLinearWork / step_work);
        for (; bad < std::min(steps, most); ++bad) {
            if (good(bad + 1)) return (bad + 1) * kGrain;
        }
    }
    for (std::int64_t step = 1; bad < most; step *= 2) {
        const std::int64_t next = std::min(bad + step, most);
        if (good(next)) return bisect(bad, next, good) * kGrain;
        bad = next;
    }
    return std::nullopt;
}

}  // namespace

Remedy smallest_change(std::span<CoreLoad> loads, std::size_t core, VcpuId id) {
    Remedy remedy;
    Vcpu* const vcpu = find(loads[core], id);
    if (!vcpu) return remedy;
    const Trial trial{loads, loads[core], *vcpu, locks_cross_cores(loads)};
    const Vcpu before = *vcpu;
    remedy.budget_less_by = least_budget_reduction(trial);
    *vcpu = before;
    remedy.period_more_by = least_period_increase(trial);
    *vcpu = before;
    if (trial.all_cores) count_remote_waits(loads);
    return remedy;
}

}  // namespace qduino::sched
