// What is asked of a core: the VCPUs that are to share it, and what the platform takes of it
// itself.
#pragma once

#include "base/fixed_string.h"
#include "base/fixed_vector.h"
#include "base/time.h"
#include "sched/blocking.h"
#include "sched/vcpu.h"

namespace qduino::sched {

inline constexpr std::size_t kCoreLimit = 64;

/// What takes a core's time above every VCPU: an interrupt thread, the kernel's fair server, top
/// halves.
///
/// Events may come in bursts: few of them in a short window, though several of such windows never
/// follow each other. One interval and one jitter cannot say both, so there may be a second pair,
/// and the one holds that allows less (two standard event models together: K. Richter,
/// "Compositional Scheduling Analysis Using Standard Event Models", TU Braunschweig 2005):
///
///   events  │            ╱ ··   ⌈(w + jitter)/interval⌉
///           │       ╱·── ──── ──
///           │   ──╱── ─·
///           │ · ╱              ╱  ⌈(w + peak_jitter)/peak_interval⌉
///           └───────────────────── window w
struct PlatformInterferer {
    FixedString<23> name;
    Nanoseconds cost{};      ///< CPU time per event
    Nanoseconds interval{};  ///< least time between two events in the long run; > 0 when cost > 0
    Nanoseconds jitter{};    ///< how much closer than that two events may come
    int source = 0;          ///< tells two of one name and of the same numbers apart
    // The same for short windows, where it says less; interval 0: nothing.
    Nanoseconds peak_interval{};
    Nanoseconds peak_jitter{};

    /// Most it can take in a window of length `window`.
    [[nodiscard]] Nanoseconds interference(Nanoseconds window) const;
    /// The share of a core, in millionths, to the nearest. Contract: cost > 0.
    [[nodiscard]] std::int64_t long_run_ppm() const {
        return (cost.count() * 1'000'000 + interval.count() / 2) / interval.count();
    }
    [[nodiscard]] bool operator==(const PlatformInterferer& other) const {
        return name.view() == other.name.view() && cost == other.cost && interval == other.interval &&
               jitter == other.jitter && source == other.source && peak_interval == other.peak_interval &&
               peak_jitter == other.peak_jitter;
    }
};

/// Measured by a board; zero in the simulator unless configured.
struct PlatformOverheads {
    // The cost of each activation, beside what is charged to its budget:
    Nanoseconds release_cost{};      ///< wake-up and two context switches
    Nanoseconds enforcement_cost{};  ///< the budget's timer
    /// Each further wait within a release, for a lock or asleep, where it is not charged to the
    /// loop's budget.
    Nanoseconds wait_cost{};
    /// How late a loop wakes, at each release and at the end of each sleep: no CPU time.
    Nanoseconds wake_latency{};
    /// The budget of the loop that an interrupt stops pays for it.
    bool victim_pays = false;
    /// To be filled by add(). The last place is what the kernel keeps (kept()).
    FixedVector<PlatformInterferer, 8> interferers;
    /// What the system keeps for its ordinary tasks in each `kept_period`, above the loops, where
    /// these leave less; 0: nothing.
    Nanoseconds kept_budget{};
    Nanoseconds kept_period{};
    FixedString<23> kept_by{"what the kernel keeps"};
    /// What ordinary programs of this core have been promised below all loops; budget 0: nothing.
    /// It never refuses a loop. Servers are chosen so that it keeps its place (admission.h).
    VcpuParameters below{};
    /// How many priorities the board tells apart. VCPUs beyond share the last one.
    std::size_t priorities = kMainVcpuLimit + kIoVcpuLimit;

    /// The cost of one activation of a VCPU.
    [[nodiscard]] Nanoseconds per_activation() const { return release_cost + enforcement_cost; }
    /// The cost of a release of `loop`, which makes so many requests for locks.
    [[nodiscard]] Nanoseconds per_release(const Vcpu& loop, std::int64_t requests) const {
        return per_activation() + (loop.times_asleep() + requests) * wait_cost;
    }
    /// Counts one more. When the table is full, the one of the nearest interval bears both: as much
    /// in any window as the two of them, or more, and nothing is left out.
    void add(const PlatformInterferer& interferer);
    /// What is kept, as an interferer: in one piece, and two pieces can meet.
    [[nodiscard]] PlatformInterferer kept() const {
        return {kept_by, kept_budget, kept_period, kept_period - kept_budget};
    }
    /// What all interferers together take in a window.
    [[nodiscard]] Nanoseconds interference(Nanoseconds window) const;
};

/// What locks that are shared between cores cost one loop (remote_blocking.h).
struct RemoteWaits {
    VcpuId loop = 0;
    int requests = 0;       ///< of such locks, in one release
    Nanoseconds longest{};  ///< from one such request to the lock
    Nanoseconds each{};     ///< how much of that the loop's own core has no part in
    /// Once, by lower loops of its own core: they have the rank of a loop that waits elsewhere.
    Nanoseconds lifted{};
};

/// All that is to run on one core.
struct CoreLoad {
    int core = 0;
    FixedVector<Vcpu, kMainVcpuLimit> mains;
    FixedVector<Vcpu, kIoVcpuLimit> ios;
    PlatformOverheads overheads;
    /// The sections of `mains` and `ios`; those of other cores do not count.
    CriticalSections sections{};
    /// The waits of those `mains` that have any; from count_remote_waits().
    FixedVector<RemoteWaits, kMainVcpuLimit> waits{};

    /// Nothing of a loop that has none.
    [[nodiscard]] RemoteWaits waits_of(VcpuId loop) const {
        for (const RemoteWaits& each : waits) {
            if (each.loop == loop) return each;
        }
        return {.loop = loop};
    }
    /// The platform's overheads, with the edges of the core's I/O VCPUs.
    [[nodiscard]] PlatformOverheads all_overheads() const;
    /// What the server of `loop` needs beside its budget: all the interrupts of a period, where it
    /// pays for them. No more than the period has left.
    [[nodiscard]] Nanoseconds allowance_of(const Vcpu& loop) const;
    /// False when the table is full.
    [[nodiscard]] bool try_add(const Vcpu& vcpu) {
        return vcpu.is_io() ? ios.try_push_back(vcpu) : mains.try_push_back(vcpu);
    }
};

}  // namespace qduino::sched
