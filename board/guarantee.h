// The guarantee report: for each loop, core and process tree, how much of what was asked for a
// board can keep. A shortfall is said and never silent.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "base/fixed_string.h"
#include "base/fixed_vector.h"
#include "base/time.h"
#include "board/types.h"

namespace qduino::board {

/// One line per loop.
struct LoopGuarantee : sched::Vcpu {
    /// Runs above everything but higher loops (SCHED_FIFO, or the simulator).
    bool priority_enforced = false;
    /// Cannot take more than its budget; at the end of a run: has not.
    bool budget_enforced = false;
    bool core_owned = false;       ///< no other task, movable interrupt or throttling on its core
    FixedString<200> shortfall{};  ///< why not, and the fix; empty when everything holds

    // How the loop kept to its budget, seen from outside on the kernel's clocks; used < 0: nobody
    // has watched it.
    Nanoseconds used{-1};       ///< CPU time since the loops began …
    Nanoseconds watched{};      ///< … and the time since then
    std::uint32_t held = 0;     ///< how often it was stopped for having taken more
    FixedString<160> escape{};  ///< what it did; empty: nothing that it could help
    /// What it was stopped for and could not help: the computer took time while it ran.
    FixedString<160> taken{};

    // Its periods since the loops began. The runtime knows them; the board does not: releases < 0.
    std::int64_t releases = -1;
    std::int64_t overruns = 0;  ///< releases that ended after the next was due
    std::int64_t dropped = 0;   ///< releases that were never run
    std::int64_t missed = 0;    ///< whole periods that the release in hand has missed so far
    Nanoseconds worst_late{};   ///< worst end after the next was due

    // The kernel threads that do bottom halves on the budget of an I/O VCPU, and at its rank.
    std::uint32_t kernel_threads = 0;
    Nanoseconds kernel_used{-1};    ///< CPU time charged to its budget; < 0: nobody keeps them
    std::uint32_t kernel_held = 0;  ///< how often their rank was taken from them for a while
};

/// One line per I/O VCPU that has run handlers; at the end of a run.
struct BottomHalfGuarantee {
    VcpuId id = kNoVcpu;
    int core = 0;
    std::uint64_t timed = 0;    ///< edges and interrupts whose instant is known …
    std::uint64_t untimed = 0;  ///< … and those of which only the number is
    // From the edge to the handler's first instruction, and at the worst to its end:
    Nanoseconds begin_median{};
    Nanoseconds begin_p999{};
    Nanoseconds begin_worst{};
    Nanoseconds end_worst{};
    // What admission promises (sched::IoResponse); the board does not know it: < 0.
    Nanoseconds response{-1};       ///< to the end, of one that finds budget …
    Nanoseconds replenishment{-1};  ///< … and for how long one may wait for budget before
};

/// One line per chain of loops that has a bound. The runtime knows them; the board does not.
struct ChainGuarantee {
    FixedString<40> name;
    FixedString<240> way;  ///< from the event to the output
    // From a change of the input to the output that answers it, and how old an output's data is:
    Nanoseconds reaction_bound{};
    Nanoseconds reaction_limit{};  ///< that the sketch asks for; 0: none
    Nanoseconds age_bound{-1};     ///< < 0: it has no age
    Nanoseconds age_limit{};
    // What was seen since the loops began:
    std::int64_t reactions = 0;
    Nanoseconds worst_reaction{};
    Nanoseconds worst_age{};
    /// Seen from there on: nobody knows when its device's event came.
    bool from_first_loop = false;
};

/// Why a release ended late, as far as the kernel's counts of that second show it.
enum class DelayCause : std::uint8_t {
    tasks,       ///< others had its core
    host,        ///< the hypervisor had it
    interrupts,  ///< interrupts had it
    charged,     ///< it waited for budget, as one of these had run on its budget
    work,        ///< it waited for budget, as it had spent its own
    unseen,      ///< nothing of all this: it slept, waited, or was interrupted shortly
    untold,      ///< its budget's account is not known
    stopped,     ///< the whole program stood still
    quota,       ///< a quota of its control group
};
inline constexpr std::size_t kDelayCauses = 9;

/// The worst that came to a loop, and what else took its core at that time; at the end of a run.
struct DelayGuarantee {
    VcpuId id = kNoVcpu;
    int core = 0;
    bool owns_core = false;
    /// For a loop that owns its core: how long after its end a spin ended. For any other: how long
    /// after the next was due a release ended.
    Nanoseconds worst{};
    /// When, since the loops began; the time that ended then, and what the kernel counted in it.
    Nanoseconds at{};
    Nanoseconds window{};
    // Each < 0 where the kernel does not tell:
    Nanoseconds host{-1};          ///< the hypervisor took the core; in steps of 10 ms
    Nanoseconds tasks{-1};         ///< the loop was ready, and another task ran on the core
    Nanoseconds interrupted{-1};   ///< the time of interrupts; in steps of 10 ms
    std::int64_t interrupts = -1;  ///< came to the core
    FixedString<40> most{};        ///< most of them were these
    std::int64_t throttled = -1;   ///< how often its budget was spent
    Nanoseconds beyond{};          ///< what was charged to it after its end, before it could stop
    /// The program stood still: it was stopped (SIGSTOP, Ctrl-Z) or frozen (a freezer of control
    /// groups), or the whole computer was.
    Nanoseconds stopped{};
    Nanoseconds quota{};  ///< quotas kept ordinary tasks of its control group waiting

    /// How many releases of the whole run ended late, by what took the core in that second.
    std::array<std::int64_t, kDelayCauses> late{};
};

/// What took at least half of `delay.worst`.
[[nodiscard]] constexpr DelayCause cause_of(const DelayGuarantee& delay) {
    const Nanoseconds half = std::max(delay.worst / 2, Nanoseconds{1});
    if (delay.quota >= half) return DelayCause::quota;
    if (delay.tasks >= half) return DelayCause::tasks;
    if (delay.host >= half) return DelayCause::host;
    if (delay.interrupted >= half) return DelayCause::interrupts;
    if (delay.stopped >= half) return DelayCause::stopped;
    if (delay.owns_core) return DelayCause::unseen;
    if (delay.throttled < 0) return DelayCause::untold;
    if (delay.throttled == 0) return DelayCause::unseen;
    return delay.beyond > Nanoseconds{0} ? DelayCause::charged : DelayCause::work;
}

/// One line per core in use.
struct CoreGuarantee {
    int core = 0;
    double interrupts_per_second = -1;  ///< residual; -1: not measured
    Nanoseconds worst_gap{-1};          ///< worst gap that a bare spin saw; -1: not measured
    double counted_per_second = -1;     ///< interrupts that admission counts; -1: none
    Nanoseconds counted_cost{};         ///< how long each is, in the mean
    double counted_share = 0;           ///< what that is of the core, in the long run
    Nanoseconds counted_at_once{};      ///< and that much may come beyond it
    /// All interrupts but the alarms of programs; -1: not measured.
    double without_alarms_per_second = -1;
    bool tick_stopped = false;
    bool throttling_lifted = false;
    FixedString<200> note;
};

/// One line per process tree that has a VCPU on a core in use
/// (board/linux/computer/core_promises.h).
struct TreeGuarantee {
    FixedString<40> name;
    int core = 0;
    Nanoseconds budget{};
    Nanoseconds period{};
    bool admitted = false;         ///< gets its budget in each period, below every loop
    Nanoseconds response{};        ///< R when admitted
    bool enforced = false;         ///< cannot take more than its budget
    FixedString<400> shortfall{};  ///< why not, and the fix; empty when everything holds
};

struct GuaranteeReport {
    /// CPU time that the watch over the budgets has used itself; < 0: nobody watches.
    Nanoseconds watch_cost{-1};
    /// Threads that the sketch made while its loops ran: ordinary ones, and nobody's budget.
    std::uint32_t strange_threads = 0;
    /// Threads and processes of the sketch's, in nobody's budget, that ran in front of loops: who,
    /// and what became of it.
    FixedString<400> intruders{};
    /// The time since the loops began, until they ended; < 0: they have not begun.
    Nanoseconds ran{-1};
    /// Why nobody knows of all that time what the loops used; empty: somebody watched all along.
    FixedString<160> watch_lost{};
    FixedString<64> board;  ///< "linux, SCHED_FIFO" …
    bool simulated = false;
    bool memory_locked = false;
    FixedVector<LoopGuarantee, kVcpuLimit> loops;
    FixedVector<BottomHalfGuarantee, kVcpuLimit> bottom_halves;
    FixedVector<CoreGuarantee, 64> cores;
    FixedVector<TreeGuarantee, 16> trees;
    FixedVector<DelayGuarantee, kVcpuLimit> delays;
    FixedVector<ChainGuarantee, sched::kChainLimit> chains;
};

}  // namespace qduino::board
