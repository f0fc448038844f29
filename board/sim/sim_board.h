// The simulated board: virtual time, any number of cores, one runner at a time; the same seed gives
// the same run.
//
// It has more functions than other classes, because it is the seam's whole list. Pins and buses it
// has from SimPins; the rest it forwards:
//
//   EventLoop   time, and who runs in it      SimCpus   cores and VCPUs       SimCore  its accounts
//   SimLocks    priority inheritance          Interrupts
//
// run(), start() and the constructor belong to the host's thread; every other call may also come
// from VCPUs (board.h).
#pragma once

#include <cstdint>
#include <span>

#include "base/result.h"
#include "base/time.h"
#include "board/board.h"
#include "board/peripherals.h"
#include "board/sim/config.h"
#include "board/sim/event_loop.h"
#include "board/sim/sim_locks.h"
#include "board/sim/sim_pins.h"
#include "board/sim/trace.h"

namespace qduino::board::sim {

class SimBoard final : public SimPins {
  public:
    /// `peripherals` and `trace` (may be null) outlive the board.
    SimBoard(SimConfig config, Peripherals& peripherals, TraceSink* trace = nullptr)
        : SimPins(std::move(config), peripherals, loop_), loop_(config_, *this, trace) {}

    // ---- time -----------------------------------------------------------------------------------
    [[nodiscard]] Instant now() override {
        loop_.before_poll(ApiCall::now);
        return loop_.now();
    }
    void busy_until(Instant t) override { loop_.busy_until(t); }
    void busy_for(Nanoseconds length) override { loop_.busy_until(loop_.now() + length); }
    void sleep_until(Instant t) override { loop_.sleep_until(t); }
    [[nodiscard]] bool serial_takes_time() const override { return config_.serial_at_baud; }
    /// Consumes `amount` of the calling VCPU's CPU time: unlike busy_until, not until an instant,
    /// so that time taken by others does not count. For tests and models of load.
    void compute(Nanoseconds amount) { loop_.compute(amount); }

    // ---- locks ----------------------------------------------------------------------------------
    void lock(LockWord& word) override {
        count_call();
        locks_.lock(word);
    }
    [[nodiscard]] bool try_lock(LockWord& word) override {
        count_call();
        return locks_.try_lock(word);
    }
    void unlock(LockWord& word) override { locks_.unlock(word); }

    // ---- VCPUs ----------------------------------------------------------------------------------
    [[nodiscard]] int core_count() const override { return loop_.cpus().core_count(); }
    [[nodiscard]] VcpuId current_vcpu() const override {
        return loop_.current() ? loop_.current()->spec.id : kNoVcpu;
    }
    [[nodiscard]] Result<void> start(std::span<const VcpuSpec> specs) override { return loop_.start(specs); }
    /// Everything before `until` happens; then now() == until, unless the board stopped earlier.
    /// May be called again to go on. run(kForever) returns when all entries have, or when nothing
    /// can happen any more.
    void run(Instant until) override { loop_.run(until); }
    /// Calls `setup`, before start(). False: it has not ended at `until`. Called again it goes on;
    /// start() leaves it where it is, for good.
    [[nodiscard]] bool run_setup(void (*setup)(), Instant until) { return loop_.run_setup(setup, until); }
    void request_stop() override { loop_.request_stop(); }
    [[nodiscard]] bool stop_requested() override {
        loop_.before_poll(ApiCall::now);
        return loop_.stop_requested();
    }
    /// All entries have returned, after a stop was requested: the pins are in their safe states.
    [[nodiscard]] bool stopped() const { return loop_.stopped(); }
    [[nodiscard]] GuaranteeReport guarantee() const override;
    /// What SimConfig takes of `core`: context switches, interrupts at the most that they come, the
    /// tick.
    [[nodiscard]] sched::PlatformOverheads platform_overheads(int core) override;
    /// Bottom halves of `device` become the work of I/O VCPU `io`; kNoVcpu: they run at once, above
    /// every loop.
    Result<void> serve_interrupts(DeviceClass device, VcpuId io) override;
    Result<void> change_io(VcpuId io, sched::VcpuParameters parameters) override;
    /// Routes a device class's interrupts away from `core`, to the lowest core that still takes
    /// them, and back. Error: unavailable when no core would take them.
    Result<void> route_interrupts(DeviceClass device, int core, bool allowed) override;
    /// Error: not_permitted when the board runs and no loop owns the core.
    Result<void> core_timer(int core, bool enabled) override;
    void note_release(Instant nominal) override {
        loop_.note(TraceKind::release);
        if (Vcpu* self = loop_.current()) self->core->release(*self, nominal, loop_.now());
    }
    void note_overrun(Nanoseconds) override { loop_.note(TraceKind::overrun); }
    /// A body that let no time pass since it last returned is charged SimConfig::body_cost.
    void note_body_end() override { loop_.note_body_end(); }

    [[nodiscard]] Instant handler_came() const override {
        return loop_.current() ? loop_.current()->came : kForever;
    }
    [[nodiscard]] Nanoseconds slept() const override {
        return loop_.current() ? loop_.current()->slept : Nanoseconds{0};
    }
    [[nodiscard]] std::int64_t sleeps() const override {
        return loop_.current() ? loop_.current()->sleeps : 0;
    }
    /// In virtual time: what spins, and what SimConfig says that calls cost.
    [[nodiscard]] Nanoseconds cpu_time() override {
        return loop_.current() ? loop_.current()->core->running_time(loop_.now()) : Nanoseconds{0};
    }

    // ---- looking at a run -----------------------------------------------------------------------
    /// The core that the calling VCPU runs on; -1 outside of VCPUs.
    [[nodiscard]] int current_core() const { return loop_.current() ? loop_.current()->spec.core : -1; }
    [[nodiscard]] std::uint64_t trace_hash() const { return loop_.hash().value(); }
    /// CPU time charged to `id` so far. An owning loop is charged for sleep too: its core is nobody
    /// else's.
    [[nodiscard]] Nanoseconds cpu_time(VcpuId id) const {
        const Vcpu* const vcpu = loop_.cpus().vcpu(id);
        return vcpu ? vcpu->core->cpu_time(id) : Nanoseconds{0};
    }
    /// Times that a VCPU's code was entered: what the fast path saves.
    [[nodiscard]] std::uint64_t resumes() const { return loop_.resumes(); }
    /// Edges that came while their I/O VCPU's queue was full.
    [[nodiscard]] std::uint64_t lost_edges() const { return loop_.lost_work(); }
    /// What took the time of `core`, and how often.
    [[nodiscard]] const CoreTally& tally(int core) const { return loop_.cpus().core(core).tally(); }
    /// CPU time charged to the VCPUs of `core` so far; of an owned core: all of it.
    [[nodiscard]] Nanoseconds busy_time(int core) const { return loop_.cpus().core(core).busy_total(); }
    /// The last spin of setup() and of each VCPU.
    [[nodiscard]] std::vector<SpinSeen> spins() const { return loop_.spins().seen(); }
    /// For EndlessJumps.
    [[nodiscard]] EventLoop& event_loop() { return loop_; }
    /// Time that top halves and shared bottom halves took from `core`.
    [[nodiscard]] Nanoseconds stolen_time(int core) const { return loop_.cpus().core(core).stolen_total(); }

  private:
    EventLoop loop_;
    SimLocks locks_{loop_};
};

}  // namespace qduino::board::sim
