#include "sched/placement.h"

#include <algorithm>

#include "base/contract.h"
#include "sched/admission.h"
#include "sched/partition.h"
#include "sched/remedy.h"

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

bool takes(const CoreLoad& load, const Vcpu& request) {
    CoreLoad trial = load;
    return trial.try_add(request) && is_admissible(trial);
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

/// The lowest other core that takes the refused VCPU, if its own core is admissible without it.
std::optional<int> other_core_for(const MulticoreAdmission& result, const Vcpu& request) {
    CoreLoad without = result.loads[static_cast<std::size_t>(request.core)];
    if (!remove(without, request.id) || !is_admissible(without)) return std::nullopt;
    for (const CoreLoad& load : result.loads) {
        Vcpu moved = request;
        moved.core = load.core;
        if (load.core != request.core && takes(load, moved)) return load.core;
    }
    return std::nullopt;
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
    for (const CoreLoad& load : result.loads) {
        if (is_admissible(load)) continue;
        result.refusal = admit(load).refusal;
        result.refused_core = load.core;
        for (const Vcpu& request : requests) {
            if (request.id == result.refusal.vcpu.id) {
                result.refusal.remedy.other_core = other_core_for(result, request);
            }
        }
        return false;
    }
    return true;
}

/// No core takes `request`: the refusal of the one that would need the smallest cut of its budget.
void refuse_everywhere(const Vcpu& request, MulticoreAdmission& result) {
    std::optional<Nanoseconds> least;
    for (const CoreLoad& load : result.loads) {
        CoreLoad trial = load;
        if (!trial.try_add(request)) continue;
        const Remedy remedy = smallest_change(trial, request.id);
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
    if (!partition.place()) {
        refuse_everywhere(partition.left_over(), result);
        return false;
    }
    for (const CoreLoad& load : result.loads) {
        for (Vcpu& vcpu : result.placed) {
            const auto is_it = [&](const Vcpu& other) { return other.id == vcpu.id; };
            if (std::ranges::any_of(load.mains, is_it) || std::ranges::any_of(load.ios, is_it))
                vcpu.core = load.core;
        }
    }
    return true;
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
    for (const CoreLoad& load : result.loads) result.cores.push_back(admit_without_remedy(load));
}

}  // namespace qduino::sched
