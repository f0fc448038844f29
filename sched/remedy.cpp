#include "sched/remedy.h"

#include <algorithm>

#include "sched/admission.h"

namespace qduino::sched {
namespace {

constexpr Nanoseconds kGrain = 1us;
constexpr std::size_t kLinearWork = 400'000;  // loops · VCPUs · steps

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

std::optional<Nanoseconds> least_budget_reduction(CoreLoad& load, Vcpu& vcpu) {
    const Nanoseconds budget = vcpu.budget;
    const std::int64_t most = (budget - Nanoseconds{1}) / kGrain;
    const auto good = [&](std::int64_t steps) {
        vcpu.budget = budget - steps * kGrain;
        return is_admissible(load);
    };
    if (most < 1 || !good(most)) return std::nullopt;
    return bisect(0, most, good) * kGrain;
}

std::optional<Nanoseconds> least_period_increase(CoreLoad& load, Vcpu& vcpu) {
    const Nanoseconds period = vcpu.period;
    const std::int64_t most = std::min((kPeriodMax - period) / kGrain, 1000 * (period / kGrain + 1));
    const auto good = [&](std::int64_t steps) {
        vcpu.period = period + steps * kGrain;
        return is_admissible(load);
    };
    std::int64_t bad = 0;
    if (!load.ios.empty()) {
        const std::size_t step_work = (load.mains.size() + 1) * (load.mains.size() + load.ios.size());
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

Remedy smallest_change(const CoreLoad& load, VcpuId id) {
    Remedy remedy;
    CoreLoad trial = load;
    if (Vcpu* vcpu = find(trial, id)) {
        remedy.budget_less_by = least_budget_reduction(trial, *vcpu);
        trial = load;
        remedy.period_more_by = least_period_increase(trial, *vcpu);
    }
    return remedy;
}

}  // namespace qduino::sched
