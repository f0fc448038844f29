// Finds out who took the core when a loop was late.
//
// A loop sees that it is late, and cannot see why: an interrupt, another task and a hypervisor all
// look the same from inside. The kernel counts what each of them took, but only since boot. So once
// a second somebody looks at both. Where a loop's worst delay has grown since the last look, what
// the kernel counted in that second is the evidence.
//
//   loop      ███████████▒▒▒▒▒███████   ▒ 49 ms late
//   looks     │ worst 3 us            │ worst 49 ms: the host took 50 ms, interrupts 283
//
// Each release that ended late is counted under the cause that the evidence of its second gives
// (cause_of()). A delay may be longer than what caused it: what a host or an interrupt takes while
// the loop runs is in its CPU time, its budget pays, and the loop waits T/C times as long. The
// keeper of the budget sees that: the thread was charged beyond the end of its budget before its
// timer could stop it.
//
// It is evidence and no proof: the kernel tells the hypervisor's time in steps of 10 ms, and what
// it is not told of shows nowhere.
//
// Allocates, and reads files: not for loops.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "base/fixed_vector.h"
#include "base/time.h"
#include "board/guarantee.h"
#include "board/linux/kernel/core_times.h"
#include "board/linux/kernel/thread_times.h"

namespace qduino::board::linux {

class DelayWitness {
  public:
    /// How late the loop of one thread has been, so far.
    struct Ward {
        VcpuId id = kNoVcpu;
        int core = 0;
        bool owns_core = false;
        pid_t tid = 0;
        Nanoseconds worst{};
        Nanoseconds worst_lately{};   ///< since the last look
        std::int64_t late = 0;        ///< releases that ended late
        std::int64_t throttled = -1;  ///< how often its budget was spent; < 0: nobody keeps it
        Nanoseconds beyond{};         ///< charged to it after its budget's end
        bool ordinary = false;        ///< no real-time thread: quotas hold for it
    };

    /// `root` precedes /proc (tests).
    explicit DelayWitness(std::string root = "") : root_(std::move(root)) {}

    /// The loops begin at `now`.
    void begin(Instant now, const std::vector<Ward>& wards);
    /// `wards` as begin() had them. Their threads live. `stood_still`: for how long the looking
    /// thread did, since the last look, though it wanted to run and had not to wait for a core.
    void look(Instant now, const std::vector<Ward>& wards, Nanoseconds stood_still = Nanoseconds{0});
    /// What the host and interrupts have taken of `core` from the beginning to the last look; 0
    /// where the kernel does not tell.
    [[nodiscard]] Nanoseconds taken_of(int core) const;
    /// A line for each loop that was late.
    void describe(GuaranteeReport& report) const;

  private:
    struct Watched {
        DelayGuarantee found;
        ThreadTimesFile times;
        sched::ThreadTimes then;  // at the last look
        Ward before;              // likewise
        bool told = false;        // the kernel tells its times
    };
    struct Core {
        int core = 0;
        CoreTimes then, now;  // at the last look, and at this one
        CoreTimes first;      // at the beginning
    };
    void add_core(int core);
    [[nodiscard]] DelayGuarantee judge(const Watched& watched, const Ward& ward, Instant now,
                                       Nanoseconds waited) const;

    std::string root_;
    Instant began_{}, looked_at_{};
    Nanoseconds stood_still_{};  // in the look under way
    Nanoseconds quota_{};        // likewise: that ordinary tasks waited for a quota
    Nanoseconds quota_then_{};   // up to the last look
    std::vector<Watched> watched_;
    std::vector<Core> cores_;
};

}  // namespace qduino::board::linux
