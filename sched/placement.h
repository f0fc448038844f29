// Placement: which core for loops that name none, and the admission of a whole computer.
//
// Cores are partitioned. VCPUs that name a core are put there first. For the others a distribution
// is looked for (partition.h): first in order of decreasing utilisation, each on the first core
// that still admits it; ties go to the lower id and the lower core. One may be kept off some cores.
// The result depends on the request alone.
#pragma once

#include <span>

#include "base/fixed_vector.h"
#include "sched/load.h"
#include "sched/verdict.h"

namespace qduino::sched {

inline constexpr std::size_t kRequestLimit = kMainVcpuLimit + kIoVcpuLimit;

struct MulticoreAdmission {
    bool admitted = false;
    /// In the order of the request, each on its core; kAnyCore: refused before one was found.
    FixedVector<Vcpu, kRequestLimit> placed;
    FixedVector<CoreLoad, kCoreLimit> loads;   ///< by core number: what was put on each
    FixedVector<Admission, kCoreLimit> cores;  ///< by core number: how that was judged
    /// The first one; because == none when admitted.
    Refusal refusal;
    int refused_core = kAnyCore;  ///< the core it asked for, or that came nearest

    /// The core of `id`, kAnyCore when it has none.
    [[nodiscard]] int core_of(VcpuId id) const;
};

/// Admits `requests` (ids unique on the computer) to cores 0 … overheads.size()-1, each with its
/// platform's overheads: all of them, or none. Writes the whole of `result`, which is large (half a
/// megabyte): keep it static. Setup-time. Contract: 1…kCoreLimit cores, at most kRequestLimit
/// requests.
void admit_all(std::span<const Vcpu> requests, std::span<const PlatformOverheads> overheads,
               const CriticalSections& sections, MulticoreAdmission& result);

}  // namespace qduino::sched
