#include "sched/admission.h"

#include <algorithm>

#include "sched/completion_time.h"
#include "sched/exact.h"
#include "sched/remedy.h"
#include "sched/remote_blocking.h"

namespace qduino::sched {
namespace {

// ---- fixed point: 56 bits behind the point, every rounding named --------------------------------

constexpr int kFractionBits = 56;
constexpr std::int64_t kOne = std::int64_t{1} << kFractionBits;
constexpr std::int64_t kTwo = 2 * kOne;
constexpr std::int64_t kSumLimit = 64 * kOne;  // beyond it nobody counts

/// a/b, never less than it is; anything above 2 reads as 2 (it is refused either way).
std::int64_t ratio_up(Nanoseconds a, Nanoseconds b) {
    if (a >= 2 * b) return kTwo;
    return mul_div_ceil(a.count(), kOne, b.count());
}

std::int64_t add_saturated(std::int64_t a, std::int64_t b) { return std::min(a + b, kSumLimit); }

/// (1 + u/n)^n <= 2, that is u <= n(2^(1/n) − 1). Each rounding is upwards, so the power is never
/// below the true one: what is within the bound here is within it in truth.
bool within_bound(std::int64_t utilisation, std::size_t n) {
    if (utilisation > kOne || n == 0) return utilisation <= kOne;
    const std::int64_t base = kOne + div_ceil(utilisation, static_cast<std::int64_t>(n));
    std::int64_t power = kOne;
    for (std::size_t i = 0; i < n; ++i) {
        if (power > kTwo) return false;
        power = mul_div_ceil(power, base, kOne);
    }
    return power <= kTwo;
}

/// Greatest u in millionths that is within the bound.
std::int64_t bound_in_ppm(std::size_t n) {
    std::int64_t within = 0;
    std::int64_t beyond = 1'000'001;
    while (beyond - within > 1) {
        const std::int64_t middle = (within + beyond) / 2;
        (within_bound(mul_div_ceil(middle, kOne, 1'000'000), n) ? within : beyond) = middle;
    }
    return within;
}

// ---- the tests ----------------------------------------------------------------------------------

Nanoseconds shortest_period(const CoreLoad& load) {
    Nanoseconds shortest = kPeriodMax;
    for (const Vcpu& main : load.mains) shortest = std::min(shortest, main.period);
    return shortest;
}

/// Left side of the bound, rounded up, with what the platform takes.
std::int64_t utilisation_of(const CoreLoad& load) {
    const PlatformOverheads overheads = load.all_overheads();
    const Nanoseconds overhead = overheads.per_activation();
    std::int64_t sum = 0;
    std::int64_t blocking = 0;
    for (const Vcpu& main : load.mains) {
        const Nanoseconds period = main.period;
        sum = add_saturated(sum, ratio_up(main.budget + overhead + load.allowance_of(main), period));
        blocking = std::max(blocking, ratio_up(overheads.interference(period), period));
    }
    for (const Vcpu& io : load.ios) {
        const std::int64_t share = std::min(kOne, ratio_up(io.budget, io.period));
        sum = add_saturated(sum, mul_div_ceil(kTwo - share, share, kOne));
    }
    return add_saturated(sum, blocking);
}

/// The bound speaks of loops that only compute, each of a priority of its own, and of bottom halves
/// whose budget exceeds what an activation costs.
bool bound_applies(const CoreLoad& load) {
    const auto sleeps = [](const Vcpu& main) { return main.deferrable; };
    const auto covers = [&](const Vcpu& io) {
        const Nanoseconds client =
            io.client_period > Nanoseconds{0} ? io.client_period : shortest_period(load);
        const std::int64_t share = mul_div_floor(io.budget.count(), client.count(), io.period.count());
        return load.overheads.per_activation() == Nanoseconds{0} ||
               share > load.overheads.per_activation().count();
    };
    return load.sections.empty() && load.mains.size() + load.ios.size() <= load.overheads.priorities &&
           load.overheads.kept_budget == Nanoseconds{0} && load.overheads.wake_latency == Nanoseconds{0} &&
           std::none_of(load.mains.begin(), load.mains.end(), sleeps) &&
           std::all_of(load.ios.begin(), load.ios.end(), covers);
}

bool io_overload(const CoreLoad& load) {
    std::int64_t sum = 0;
    for (const Vcpu& io : load.ios) {
        sum += mul_div_floor(io.budget.count(), kOne / kIoVcpuLimit, io.period.count());
    }
    return sum > kOne / static_cast<std::int64_t>(kIoVcpuLimit);
}

bool owns_core(const Vcpu& request) {
    return !request.is_io() && request.parameters().whole_core() && request.core != kAnyCore;
}

const Vcpu* owner_of(const CoreLoad& load) {
    for (const Vcpu& main : load.mains) {
        if (owns_core(main)) return &main;
    }
    return nullptr;
}

/// The owner needs no test: it is alone, and waits for nobody. (With overheads, R of a whole core
/// is beyond its period.)
bool owned_without_waits(const CoreLoad& load) {
    const auto waits = [](const RemoteWaits& each) { return each.requests > 0; };
    return owner_of(load) && std::ranges::none_of(load.waits, waits);
}

const Vcpu& nth(const CoreLoad& load, std::size_t n) {
    return n < load.mains.size() ? load.mains[n] : load.ios[n - load.mains.size()];
}

/// Refusals that need no analysis.
Refusal refuse_by_shape(const CoreLoad& load) {
    Refusal refusal;
    const auto refuse = [&](RefusedBecause because, const Vcpu& request, VcpuId other) {
        refusal.because = because;
        refusal.vcpu = request;
        refusal.other = other;
        return refusal;
    };
    const std::size_t count = load.mains.size() + load.ios.size();
    for (std::size_t i = 0; i < count; ++i) {
        const Vcpu& request = nth(load, i);
        if (!request.parameters().valid()) return refuse(RefusedBecause::bad_parameters, request, request.id);
        for (std::size_t j = 0; j < i; ++j) {
            if (nth(load, j).id == request.id)
                return refuse(RefusedBecause::duplicate_id, request, request.id);
        }
    }
    if (const Vcpu* owner = owner_of(load); owner && count > 1) {
        const Vcpu& second = &nth(load, 0) == owner ? nth(load, 1) : nth(load, 0);
        return refuse(RefusedBecause::core_owned, second, owner->id);
    }
    if (load.mains.empty() && io_overload(load)) {
        return refuse(RefusedBecause::io_overload, load.ios.back(), load.ios.back().id);
    }
    return refusal;
}

Refusal refuse_by_completion_time(const CompletionTime& analysis, std::size_t i,
                                  const LoopResponse& response) {
    Refusal refusal;
    refusal.because = RefusedBecause::completion_time;
    refusal.vcpu = analysis.loop(i);
    refusal.response = response;
    refusal.shares = analysis.shares(i, response.period);
    return refusal;
}

Refusal refuse_late_service(const CoreLoad& load, const CompletionTime& analysis) {
    Refusal refusal;
    const auto late = load.mains.empty() ? std::nullopt : analysis.late_service();
    if (!late || analysis.meets_beside_whole_services()) return refusal;
    refusal.because = RefusedBecause::late_service;
    refusal.vcpu = load.ios[late->io];
    refusal.response = {refusal.vcpu.id, late->response, late->client};
    refusal.late = VcpuKind::io;
    refusal.shares = analysis.io_shares(late->io, late->client, late->client);
    return refusal;
}

}  // namespace

bool admitted_by_bound(const CoreLoad& load) {
    return bound_applies(load) && within_bound(utilisation_of(load), load.mains.size());
}

Admission admit_without_remedy(const CoreLoad& load) {
    Admission admission;
    admission.core = load.core;
    admission.refusal = refuse_by_shape(load);
    if (admission.refusal.because != RefusedBecause::none) return admission;

    const std::int64_t utilisation = utilisation_of(load);
    admission.utilisation_ppm = mul_div_floor(utilisation + kOne / 2'000'000, 1'000'000, kOne);
    admission.bound_ppm = bound_in_ppm(load.mains.size());
    const bool owned = owned_without_waits(load);
    const bool by_bound = bound_applies(load) && within_bound(utilisation, load.mains.size());
    admission.by = owned ? AdmittedBy::owned : by_bound ? AdmittedBy::bound : AdmittedBy::completion_time;

    const CompletionTime analysis{load};
    const auto verdicts = analysis.verdicts();
    for (std::size_t i = 0; i < analysis.size(); ++i) {
        LoopResponse response = verdicts[i];
        // Proven to meet its period, by other means than the equation: its R is then no more than
        // an upper limit.
        if (owned || by_bound) response.response = std::min(response.response, response.period);
        admission.loops.push_back(response);
        if (!response.meets() && admission.refusal.because == RefusedBecause::none) {
            admission.refusal = refuse_by_completion_time(analysis, i, response);
        }
    }
    for (std::size_t k = 0; k < load.ios.size() && analysis.size() > 0; ++k)
        admission.ios.push_back(analysis.io_verdict(k));
    if (!owned && admission.refusal.because == RefusedBecause::none)
        admission.refusal = refuse_late_service(load, analysis);
    admission.admitted = admission.refusal.because == RefusedBecause::none;
    return admission;
}

Admission admit(const CoreLoad& load) {
    Admission admission = admit_without_remedy(load);
    if (is_late(admission.refusal.because)) {
        CoreLoad trial = load;
        admission.refusal.remedy = smallest_change({&trial, 1}, 0, admission.refusal.vcpu.id);
    }
    return admission;
}

bool is_admissible(const CoreLoad& load) {
    if (refuse_by_shape(load).because != RefusedBecause::none) return false;
    if (owned_without_waits(load)) return true;
    const bool by_bound = admitted_by_bound(load);
    if (by_bound && load.ios.empty()) return true;
    const CompletionTime analysis{load};
    if (!by_bound && !analysis.every_loop_meets()) return false;
    return load.mains.empty() || !analysis.late_service() || analysis.meets_beside_whole_services();
}

Nanoseconds response_below_all(const CoreLoad& load, Nanoseconds budget, Nanoseconds limit) {
    constexpr VcpuId kLowestRank = 255;
    CoreLoad with = load;
    Nanoseconds longest = limit;
    for (const Vcpu& loop : load.mains) longest = std::max(longest, loop.period);
    // The longest period and the highest number: the lowest rank. Its own period does not enter R.
    if (!with.mains.try_push_back(
            {.id = kLowestRank, .budget = budget, .period = longest, .core = load.core}))
        return limit + Nanoseconds{1};
    const CompletionTime analysis{with};
    return analysis.response(analysis.size() - 1, limit);
}

bool keeps_promise_below(const CoreLoad& load) {
    const VcpuParameters& below = load.overheads.below;
    return below.budget <= Nanoseconds{0} ||
           response_below_all(load, below.budget, below.period) <= below.period;
}

bool are_admissible(std::span<CoreLoad> loads) {
    count_remote_waits(loads);
    return std::ranges::all_of(loads, is_admissible);
}

}  // namespace qduino::sched
