// What is asked of a core: the VCPUs that are to share it, and what the platform takes of it
// itself.
#pragma once

#include "base/fixed_string.h"
#include "base/fixed_vector.h"
#include "base/time.h"
#include "sched/blocking.h"
#include "sched/vcpu.h"

namespace qduino::sched {

/// What takes a core's time above every VCPU: an interrupt thread, the kernel's fair server, top
/// halves.
struct PlatformInterferer {
    FixedString<23> name;
    Nanoseconds cost{};      ///< CPU time per event
    Nanoseconds interval{};  ///< least time between two events in the long run; > 0 when cost > 0
    Nanoseconds jitter{};    ///< how much closer than that two events may come

    /// Most it can take in a window of length `window`.
    [[nodiscard]] Nanoseconds interference(Nanoseconds window) const;
};

/// Measured by a board; zero in the simulator unless configured.
struct PlatformOverheads {
    Nanoseconds release_cost{};      ///< wake-up and two context switches, per activation
    Nanoseconds enforcement_cost{};  ///< budget timer and its handler, per activation
    FixedVector<PlatformInterferer, 8> interferers;
    /// What the system keeps for its ordinary tasks in each `kept_period`, above the loops, where
    /// these leave less; 0: nothing.
    Nanoseconds kept_budget{};
    Nanoseconds kept_period{};
    /// How many priorities the board tells apart. Loops beyond share the last one.
    std::size_t priorities = kMainVcpuLimit;

    /// Of one activation of a VCPU.
    [[nodiscard]] Nanoseconds per_activation() const { return release_cost + enforcement_cost; }
    /// What all interferers together take in a window.
    [[nodiscard]] Nanoseconds interference(Nanoseconds window) const;
};

/// All that is to run on one core.
struct CoreLoad {
    int core = 0;
    FixedVector<Vcpu, kMainVcpuLimit> mains;
    FixedVector<Vcpu, kIoVcpuLimit> ios;
    PlatformOverheads overheads;
    CriticalSections sections{};  ///< of `mains`

    /// False when the table is full.
    [[nodiscard]] bool try_add(const Vcpu& vcpu) {
        return vcpu.is_io() ? ios.try_push_back(vcpu) : mains.try_push_back(vcpu);
    }
};

}  // namespace qduino::sched
