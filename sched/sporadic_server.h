// Sporadic server: what a main VCPU (a loop) may run, and when.
//
//   budget 3, period 10        ██ runs     · has work, waits for a refill
//
//   t    0  1  2  3  4  5  6  7  8  9 10 11 12 13 14 15 16
//        ██ (blocked)   ██ ██  ·  ·  · ██  ·  ·  ·  · ██ ██
//        └──────── one period ────────►└►
//                       └──────── one period ────────►└──►  each chunk, from when *it* was active
//
// B. Sprunt, "Aperiodic task scheduling for real-time systems", 1990; as corrected by M. Stanovich
// et al., RTAS 2010:
// - No budget amplification: in every window of one period, a server that nothing of higher
//   priority holds up consumes at most its budget, plus the overrun that a late enforcement
//   allowed.
// - No premature replenishment: a chunk comes back one period after the instant at which that chunk
//   became active, and not after the instant at which the server did.
// - An overrun is charged to the refills to come, which are split for it. It is never forgiven.
// - Unblocking moves the refills that have waited up to now, in one piece: an idle server saves up
//   nothing.
// - When the list of refills is full, a merge delays a refill and never advances one. To lower
//   priorities the server is then no worse than a periodic task (budget, period): admission.h rests
//   on that.
//
// State: the refills (refill_queue.h) and whether it has work. Invariant: Σ refills == budget,
// checked around every operation.
#pragma once

#include <cstddef>

#include "base/time.h"
#include "sched/refill_queue.h"
#include "sched/vcpu.h"

namespace qduino::sched {

struct SporadicServerOptions {
    /// Refills remembered, 1…RefillQueue::kCapacity. With fewer, a loop that blocks often waits
    /// longer.
    std::size_t refill_limit = RefillQueue::kCapacity;
    /// Runs shorter than this are held back until they join the next: a timer for a splinter of
    /// budget costs more than the splinter. So does a sleep for a gap: a throttled server whose
    /// next two runs are nearer than this waits until they are one. 0: every run stands for itself.
    Nanoseconds shortest_run{0};
};

/// One owner at a time (the core's scheduler, or the thread whose budget it is). No call blocks or
/// allocates.
class SporadicServer {
  public:
    SporadicServer() = default;  ///< for containers only: assign before use
    /// Full budget from `start` on; blocked. Contract: parameters.valid().
    explicit SporadicServer(VcpuParameters parameters, Instant start = kEpoch,
                            SporadicServerOptions options = {});

    /// CPU time that it may take from `now` on without a pause; 0 when throttled. The same whether
    /// it is blocked or not.
    [[nodiscard]] Nanoseconds available(Instant now) const;
    /// Has budget at `now`.
    [[nodiscard]] bool eligible(Instant now) const { return refills_.head().time <= now; }
    /// The instant from which the head refill may be used. It is in the future exactly when
    /// throttled.
    [[nodiscard]] Instant next_replenishment() const { return refills_.head().time; }

    /// Charges `used` of CPU time that ended at `now_end`. Call it when the VCPU is preempted,
    /// throttled or blocks, and at the latest when available() has run out. Use beyond what was
    /// available is an overrun and is charged forward. Returns the overrun: exact if the time was
    /// used in one piece, a lower bound otherwise. May be called while blocked, too: a thread pays
    /// for its last instructions before it sleeps. Contract: used >= 0.
    Nanoseconds consume(Instant now_end, Nanoseconds used);
    /// The VCPU has work again. No effect when it already had.
    void unblock(Instant now);
    /// The VCPU has no work. Charge what it has used first.
    void block(Instant now);

    [[nodiscard]] bool blocked() const { return blocked_; }
    /// Σ of all refills: the budget, always.
    [[nodiscard]] Nanoseconds total() const { return refills_.total(); }
    /// Charged so far, ever.
    [[nodiscard]] Nanoseconds consumed() const { return consumed_; }
    [[nodiscard]] const VcpuParameters& parameters() const { return parameters_; }
    [[nodiscard]] std::span<const Refill> refills() const { return refills_.refills(); }

  private:
    VcpuParameters parameters_{};
    RefillQueue refills_;
    Nanoseconds shortest_run_{0};
    Nanoseconds consumed_{0};
    bool blocked_ = true;
};

}  // namespace qduino::sched
