#include "sched/placement.h"

#include <algorithm>

#include "base/contract.h"
#include "sched/admission.h"
#include "sched/partition.h"
#include "sched/remedy.h"
#include "sched/remote_blocking.h"

namespace qduino::sched {
namespace {

bool same_id_before(std::span<const Vcpu> requests, std::size_t index) {
    return std::any_of(requests.begin(), requests.begin() + static_cast<std::ptrdiff_t>(index),
                       [&](const Vcpu& earlier) { return earlier.id == requests[index].id; });
}

/// Refusals that hold whatever the core.
Refusal refuse_by_shape(std::span<const Vcpu> requests, std::size_t core_count) {
    Refusal refusal;
    for (std::size_t i = 0; i < requests.size(); ++i) {
        const Vcpu& request = requests[i];
        refusal.vcpu = request;
        refusal.other = request.id;
        if (!request.parameters().valid()) {
            refusal.because = RefusedBecause::bad_parameters;
        } else if (same_id_before(requests, i)) {
            refusal.because = RefusedBecause::duplicate_id;
        } else if (request.core != kAnyCore &&
                   (request.core < 0 || request.core >= static_cast<int>(core_count))) {
            refusal.because = RefusedBecause::no_such_core;
        }
        if (refusal.because != RefusedBecause::none) return refusal;
    }
    return Refusal{};
}

bool remove(CoreLoad& load, VcpuId id) {
    const auto drop = [id](auto& list) {
        for (std::size_t i = 0; i < list.size(); ++i) {
            if (list[i].id == id) return list.erase(i), true;
        }
        return false;
    };
    return drop(load.mains) || drop(load.ios);
}

/// The refusal of the first core that is not admissible; false: each one is.
bool refuse_first(MulticoreAdmission& result) {
    for (const CoreLoad& load : result.loads) {
        if (is_admissible(load)) continue;
        result.refusal = admit_without_remedy(load).refusal;
        result.refusal.sharers = remote_sharers(result.loads, result.refusal.vcpu.id);
        result.refused_core = load.core;
        return true;
    }
    return false;
}

/// The lowest other core that takes the refused VCPU, if its own core is admissible without it.
std::optional<int> other_core_for(MulticoreAdmission& result, const Vcpu& request) {
    const std::span<CoreLoad> loads{result.loads.begin(), result.loads.size()};
    CoreLoad& own = loads[static_cast<std::size_t>(request.core)];
    const CoreLoad before = own;
    std::optional<int> found;
    if (remove(own, request.id) && is_admissible(own)) {
        for (CoreLoad& load : loads) {
            Vcpu moved = request;
            moved.core = load.core;
            if (&load == &own || !load.try_add(moved)) continue;
            const bool fits = locks_cross_cores(loads) ? are_admissible(loads) : is_admissible(load);
            remove(load, request.id);
            if (fits) {
                found = load.core;
                break;
            }
        }
    }
    own = before;
    count_remote_waits(loads);
    return found;
}

/// Puts each VCPU that names a core there. False when a core refuses.
bool place_pinned(std::span<const Vcpu> requests, MulticoreAdmission& result) {
    for (std::size_t i = 0; i < requests.size(); ++i) {
        const Vcpu& request = requests[i];
        if (request.core == kAnyCore) continue;
        CoreLoad& load = result.loads[static_cast<std::size_t>(request.core)];
        if (!load.try_add(request)) {
            result.refusal.because = RefusedBecause::too_many;
            result.refusal.vcpu = request;
            result.refused_core = request.core;
            return false;
        }
        result.placed[i].core = request.core;
    }
    count_remote_waits(result.loads);
    if (!refuse_first(result)) return true;
    Refusal& refusal = result.refusal;
    if (is_late(refusal.because))
        refusal.remedy =
            smallest_change(result.loads, static_cast<std::size_t>(result.refused_core), refusal.vcpu.id);
    for (const Vcpu& request : requests) {
        if (request.id == refusal.vcpu.id) refusal.remedy.other_core = other_core_for(result, request);
    }
    return false;
}

/// No core takes `request`: the refusal of the one that would need the smallest cut of its budget.
void refuse_everywhere(const Vcpu& request, MulticoreAdmission& result) {
    std::optional<Nanoseconds> least;
    for (const CoreLoad& load : result.loads) {
        CoreLoad trial = load;
        if (!request.may_be_on(load.core) || !trial.try_add(request)) continue;
        const Remedy remedy = smallest_change({&trial, 1}, 0, request.id);
        const bool nearer = remedy.budget_less_by && (!least || *remedy.budget_less_by < *least);
        if (result.refused_core != kAnyCore && !nearer) continue;
        if (remedy.budget_less_by) least = remedy.budget_less_by;
        const Admission admission = admit_without_remedy(trial);
        result.refusal = admission.refusal;
        result.refusal.remedy = remedy;
        result.refused_core = load.core;
    }
    result.refusal.because = RefusedBecause::no_core_fits;
    result.refusal.vcpu = request;
}

bool place_floating(std::span<const Vcpu> requests, MulticoreAdmission& result) {
    Partition partition{requests, result.loads};
    const bool placed = partition.place();
    if (!placed && partition.left_over()) {
        refuse_everywhere(*partition.left_over(), result);
        return false;
    }
    for (const CoreLoad& load : result.loads) {
        for (Vcpu& vcpu : result.placed) {
            const auto is_it = [&](const Vcpu& other) { return other.id == vcpu.id; };
            if (std::ranges::any_of(load.mains, is_it) || std::ranges::any_of(load.ios, is_it))
                vcpu.core = load.core;
        }
    }
    // Each core takes what was put there, but for waits for the others.
    if (!placed) refuse_first(result);
    return placed;
}

/// Budgets of loops that wait for other cores come back at each release: remote_blocking.h.
void make_waiters_deferrable(MulticoreAdmission& result) {
    for (CoreLoad& load : result.loads) {
        for (Vcpu& loop : load.mains) {
            if (load.waits_of(loop.id).requests > 0) loop.deferrable = true;
        }
    }
}

}  // namespace

int MulticoreAdmission::core_of(VcpuId id) const {
    for (const Vcpu& vcpu : placed) {
        if (vcpu.id == id) return vcpu.core;
    }
    return kAnyCore;
}

void admit_all(std::span<const Vcpu> requests, std::span<const PlatformOverheads> overheads,
               const CriticalSections& sections, MulticoreAdmission& result) {
    QDUINO_EXPECT(!overheads.empty() && overheads.size() <= kCoreLimit);
    QDUINO_EXPECT(requests.size() <= kRequestLimit);
    result.admitted = false;
    result.placed.clear();
    result.cores.clear();
    result.loads.clear();
    result.refused_core = kAnyCore;
    for (const Vcpu& request : requests) {
        result.placed.push_back(request);
        result.placed.back().core = kAnyCore;
    }
    for (const PlatformOverheads& overhead : overheads) {
        CoreLoad load;
        load.core = static_cast<int>(result.loads.size());
        load.overheads = overhead;
        load.sections = sections;
        result.loads.push_back(load);
    }
    result.refusal = refuse_by_shape(requests, overheads.size());
    result.admitted = result.refusal.because == RefusedBecause::none && place_pinned(requests, result) &&
                      place_floating(requests, result);
    make_waiters_deferrable(result);
    for (const CoreLoad& load : result.loads) result.cores.push_back(admit_without_remedy(load));
}

}  // namespace qduino::sched
