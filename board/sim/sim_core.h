// One simulated core: sched::CoreScheduler decides which VCPU runs; this class keeps the core's
// accounts between two decisions.
//
//   accounted_                     now
//   ──|█████████████████|▒▒▒▒▒▒▒▒▒▒▒▒|──►    █ the running VCPU's: charged to its budget, and taken
//                       └ steal() ───┘         off its work_left
//                                            ▒ taken by interrupts: delays the VCPU, and is charged
//                                              to it only on request
//
// A switch to another VCPU and the one back are stolen as well. Admission has counted them once in
// each period, and for each sleep and each wait for a lock that were declared. A VCPU that gives
// the core up more often pays for that from its own budget, where others are on its core: otherwise
// those below would.
//
// Invariants: every stretch of time is charged once; while time is stolen no VCPU code goes on and
// no decision is made.
#pragma once

#include <algorithm>
#include <vector>

#include "base/time.h"
#include "board/sim/config.h"
#include "board/sim/tally.h"
#include "board/sim/vcpu.h"
#include "sched/core_scheduler.h"

namespace qduino::board::sim {

class EventLoop;

class SimCore {
  public:
    SimCore(EventLoop& loop, const SimConfig& config, int number)
        : loop_(loop), config_(config), number_(number) {}

    /// Setup-time. False when the scheduler's table refuses it.
    [[nodiscard]] bool add(Vcpu& vcpu, Instant now);

    /// Interrupts take `cost` of this core from `now` on, after those already doing so. Whom they
    /// stop pays for them, where the board says so.
    void interrupt(Instant now, Nanoseconds cost);
    /// Charges the running VCPU up to `now`.
    void account(Instant now);
    /// Does what is due here: charges; then, if the running VCPU has got what it asked for, its
    /// code goes on first (ready()), because it takes no time and may give the CPU up; else
    /// decides.
    void settle(Instant now);
    /// Wakes sleepers whose instant has come and decides who runs. Also due after the running
    /// VCPU's code went on.
    void decide(Instant now);
    /// The running VCPU left the CPU: it sleeps or its entry returned.
    void give_up(Vcpu& vcpu, Instant now);
    /// A VCPU of this core was given work: settle() is to be called at `now`.
    void settle_soon(Instant now) { disturbed_at_ = std::min(disturbed_at_, now); }

    /// The running VCPU begins the release that was due at `nominal`.
    void release(Vcpu& vcpu, Instant nominal, Instant now);
    /// I/O VCPU `io` has more work, for a client of `client_period`; 0: for the usual one.
    void work_came(Vcpu& io, Nanoseconds client_period, Instant now);
    /// It has another budget and period from `now` on.
    void change_io(Vcpu& io, sched::VcpuParameters parameters, Instant now);
    /// The VCPU inherits what vcpu.inherited says: decided at `now`.
    void inherit(const Vcpu& vcpu, Instant now);

    [[nodiscard]] Nanoseconds budget_left(VcpuId id, Instant now) const {
        return scheduler_.available(id, now);
    }

    /// The next instant at which settle() is due.
    [[nodiscard]] Instant next_due() const { return ready_ ? kForever : std::min(disturbed_at_, done_at_); }
    /// The earliest instant at which something other than the running VCPU's own demand is due
    /// here.
    [[nodiscard]] Instant disturbed_at() const { return disturbed_at_; }
    /// The running VCPU's code may go on now.
    [[nodiscard]] bool ready() const { return ready_; }
    [[nodiscard]] Vcpu* running() const { return running_; }
    /// The loop that has this core for itself, or null.
    [[nodiscard]] const Vcpu* owner() const;

    [[nodiscard]] int number() const { return number_; }
    [[nodiscard]] Nanoseconds stolen_total() const { return stolen_total_; }
    [[nodiscard]] CoreTally& tally() { return tally_; }
    [[nodiscard]] const CoreTally& tally() const { return tally_; }
    /// CPU time of all loops and I/O VCPUs of this core.
    [[nodiscard]] Nanoseconds busy_total() const;
    [[nodiscard]] Nanoseconds cpu_time(VcpuId id) const { return scheduler_.consumed(id); }
    /// CPU time of the running VCPU up to `now`, which is not charged yet.
    [[nodiscard]] Nanoseconds running_time(Instant now) const;

  private:
    /// The same, paid for by nobody.
    void steal(Instant now, Nanoseconds cost);
    /// What of the `stolen` time the running VCPU pays for.
    [[nodiscard]] Nanoseconds paid_of(Nanoseconds stolen) const { return std::min(stolen, to_be_paid_); }
    [[nodiscard]] bool interrupted(Instant now);
    void wake_sleepers(Instant now);
    void pay_for_wake(Vcpu& vcpu, Instant now);
    void pay_for_throttling(Vcpu& vcpu, Instant now);
    void pay_for_lock(Vcpu& vcpu, Instant now);
    void pay(const Vcpu& vcpu, Instant now);
    void apply_faults(Vcpu& vcpu, Instant now) const;
    void turn_to(Vcpu* next, Instant now);
    void trace_throttling(Instant now);
    [[nodiscard]] Vcpu* find(VcpuId id) const;

    EventLoop& loop_;
    const SimConfig& config_;
    int number_;
    sched::CoreScheduler scheduler_;
    std::vector<Vcpu*> vcpus_;  // in order of id
    Vcpu* running_ = nullptr;
    bool ready_ = false;
    Instant accounted_ = kEpoch;
    Instant stolen_until_ = kEpoch;
    Nanoseconds stolen_total_{};
    Nanoseconds to_be_paid_{};  // of what was stolen, and is not accounted for yet
    CoreTally tally_;
    Instant disturbed_at_ = kForever;
    Instant done_at_ = kForever;
};

}  // namespace qduino::board::sim
