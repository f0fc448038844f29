// Virtual time, and who runs in it. One runner at a time: the same seed gives the same run.
//
// Every VCPU is a fiber. Its code takes no time; time is what it asks for (busy_until, sleep_until,
// and what SimConfig says a call or an interrupt costs), unless it spins (spin_watch.h). run() goes
// from instant to instant:
//
//      ┌─────────────► something due now? ── yes ──► physics, interrupts, then each core settles
//      │                     │ no
//      │               a core whose VCPU has had the time it asked for? ── yes ──► its fiber
//      │                     │ no                                                  │ asks for more
//      │               jump to the next instant at which something is due                     │
//      └─────────────────────┴────────────────────────────────────────────────────────────────┘
//
// The horizon makes it fast. Before a fiber is resumed, the earliest instant at which anything
// *else* happens is put in horizon_ (another core, an interrupt, the end of its budget, a wake-up,
// the physics, the end of the run). A loop that asks for an instant before it cannot be disturbed
// on the way, so busy_until() is a comparison and a store, without a switch:
//
//      now_ ──►·····························| horizon_
//      core 1  busy_until(t1) t2) t3)…      |           no event loop up to here
//      core 0  (spinning until here) ───────|
//
// Charging is done when the core settles, for the whole stretch at once.
//
// Invariants: now_ never runs backwards; exactly one fiber runs, or none; a VCPU is resumed only on
// its core, with budget (or owning it), not before the instant it asked for. Enforcement is exact:
// a budget ends at the nanosecond.
//
// It has more functions and members than other classes. Nine functions are the fast path, of one
// line or two each; and what the fast path reads lies together, in front of the rest.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "base/result.h"
#include "base/time.h"
#include "board/sim/config.h"
#include "board/sim/interrupts.h"
#include "board/sim/sim_cpus.h"
#include "board/sim/spin_watch.h"
#include "board/sim/trace.h"

namespace qduino::board::sim {

class SimPins;

class EventLoop {
  public:
    /// `config` and `pins` outlive it; `trace` (may be null) as well.
    EventLoop(const SimConfig& config, SimPins& pins, TraceSink* trace);

    // ---- time: for whoever runs, a VCPU or the host ---------------------------------------------
    [[nodiscard]] Instant now() const { return now_; }
    void busy_until(Instant t) {
        if (t < horizon_) [[likely]] {
            pass_time_to(t);
        } else {
            busy_through_events(t);
        }
    }
    void sleep_until(Instant t) {
        if (wake_latency_ > Nanoseconds{0} && t > now_ && t < kForever - wake_latency_) [[unlikely]]
            t += wake_latency_;
        if (t < horizon_ && sleep_is_local_) {
            pass_time_to(t);
        } else {
            sleep_through_events(t);
        }
    }
    /// A call of this kind takes its CPU time.
    void charge(ApiCall call) {
        tally_->note(call);
        if (calls_cost_) [[unlikely]]
            consume(config_.costs[call]);
    }
    /// The same for a call that asks for something: more than `poll_limit` of them at one instant
    /// are a spin, and cost time.
    void before_poll(ApiCall call) {
        tally_->note(call);
        if (++polls_ > free_polls_) [[unlikely]]
            charge_poll(call);
    }
    /// The code asked the host's system, in vain. More than `poll_limit` such questions at one
    /// instant cost time, and it is the same spin as before: it still stands where it stood.
    void ask_host();
    void consume(Nanoseconds cost);
    void compute(Nanoseconds amount) {
        polls_ = 0;
        consume(amount);
    }
    /// The running code spins for `amount`, or until the code of another VCPU has run.
    void spin_for(Nanoseconds amount);
    /// Makes the running code look up before it takes more time: another VCPU has something to do
    /// now, or at `t`.
    void look_up() { horizon_ = now_; }
    void look_up_at(Instant t) { horizon_ = t < horizon_ ? t : horizon_; }

    // ---- VCPUs ----------------------------------------------------------------------------------
    [[nodiscard]] Result<void> start(std::span<const VcpuSpec> specs);
    void run(Instant until);
    /// Calls `setup`, before start(), on a stack of its own; false when virtual time comes to
    /// `until` first. Called again it goes on where it was, or it is left there for good.
    [[nodiscard]] bool run_setup(void (*setup)(), Instant until);
    /// setup() was begun, and has not ended.
    [[nodiscard]] bool in_setup() const { return setup_ != nullptr; }
    /// The code that runs leaves at its next call; run() or run_setup() returns then, and virtual
    /// time stays where it is. In a handler of a signal, on their thread; again and again, until
    /// they have.
    void leave_soon() {
        leaving_ = true;
        horizon_ = now_;
    }
    void request_stop() { stop_requested_ = true; }
    [[nodiscard]] bool stop_requested() const { return stop_requested_; }
    [[nodiscard]] bool stopped() const { return stopped_; }
    [[nodiscard]] bool started() const { return started_; }
    /// Null: the host runs.
    [[nodiscard]] Vcpu* current() const { return current_; }
    [[nodiscard]] SimCpus& cpus() { return cpus_; }
    [[nodiscard]] const SimCpus& cpus() const { return cpus_; }
    [[nodiscard]] Interrupts& interrupts() { return interrupts_; }
    [[nodiscard]] const Interrupts& interrupts() const { return interrupts_; }
    [[nodiscard]] SpinWatch& spins() { return spins_; }
    [[nodiscard]] const SpinWatch& spins() const { return spins_; }
    /// The calling VCPU sleeps until another one, or an event, sets its `wake`.
    void wait();
    /// False, and counted, when I/O VCPU `io` is not there, has ended, or has no room.
    void give_work(VcpuId io, Work work);
    /// `cost` of CPU time for a device that the calling VCPU uses: its own time, or, where an I/O
    /// VCPU serves the class, that one's, for which a loop waits asleep.
    void work_of_device(DeviceClass device, Nanoseconds cost);

    // ---- trace ----------------------------------------------------------------------------------
    void emit(int core, VcpuId vcpu, TraceKind kind);
    void tell_ready(int core, VcpuId vcpu) {
        if (trace_) trace_->on_ready(now_, core, vcpu);
    }
    void tell_taken(int core, Instant from, Instant until) {
        if (trace_) trace_->on_taken(now_, core, from, until);
    }
    /// Emits `kind` for the calling VCPU; without one: nothing.
    void note(TraceKind kind);
    void note_body_end() {
        if (!current_) return;
        if (current_->body_ended == now_) consume(config_.body_cost);
        current_->body_ended = now_;
    }
    [[nodiscard]] TraceHash& hash() { return hash_; }
    [[nodiscard]] const TraceHash& hash() const { return hash_; }
    [[nodiscard]] std::uint64_t resumes() const { return resumes_; }
    [[nodiscard]] std::uint64_t lost_work() const { return lost_work_; }
    void note_lost_edge() { ++lost_work_; }

  private:
    // The fast path: nothing else happens before `t`.
    void pass_time_to(Instant t) {
        if (t <= now_) return;
        now_ = t;
        polls_ = 0;
    }
    void charge_poll(ApiCall call);
    void busy_through_events(Instant t);
    void sleep_through_events(Instant t);
    void pass_setup_time_to(Instant t);
    void tell_spins(const Vcpu& ran);
    static void vcpu_main(void* vcpu);
    void serve(Vcpu& io);
    void wake_up(Vcpu& vcpu);
    [[nodiscard]] Instant next_due() const;
    void process_due();
    void fire_interrupts();
    void execute(SimCore& core);
    void end();

    // Read by every call of the fast path: kept together.
    Instant now_ = kEpoch;
    Instant horizon_ = kForever;
    // No scheduling decision hangs on it: the host, or a loop that owns its core.
    bool sleep_is_local_ = true;
    bool calls_cost_ = false;
    bool stop_requested_ = false;
    bool stopped_ = false;
    bool started_ = false;
    volatile bool leaving_ = false;
    std::uint32_t polls_ = 0;       // of the time or of a pin at one instant
    std::uint32_t free_polls_ = 0;  // so many of them cost nothing
    CoreTally* tally_ = &host_;     // of the core whose code runs
    Nanoseconds wake_latency_{};
    TraceHash hash_;
    Vcpu* current_ = nullptr;

    const SimConfig& config_;
    SimPins& pins_;
    TraceSink* trace_;
    Instant until_ = kForever;
    Interrupts interrupts_;
    SimCpus cpus_;
    SpinWatch spins_;
    int spinning_ = 0;              // VCPUs that wait in spin_for()
    std::unique_ptr<Fiber> setup_;  // null: it has not begun, or has ended
    std::uint64_t lost_work_ = 0;
    std::uint64_t resumes_ = 0;
    CoreTally host_;  // calls from outside of VCPUs
};

}  // namespace qduino::board::sim
