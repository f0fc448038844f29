// The simulated board: virtual time, any number of cores, one runner at a time; the same seed gives
// the same run.
//
// It has more functions than other classes, because it is the seam's whole list, and forwards:
//
//   EventLoop   time, and who runs in it      SimCpus   cores and VCPUs       SimCore  its accounts
//   SimPins     pins, buses, edges            SimLocks  priority inheritance  Interrupts
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

class SimBoard final : public Board {
  public:
    /// `peripherals` and `trace` (may be null) outlive the board.
    SimBoard(SimConfig config, Peripherals& peripherals, TraceSink* trace = nullptr)
        : config_(std::move(config)), loop_(config_, pins_, trace), pins_(config_, peripherals, loop_) {}
    SimBoard(const SimBoard&) = delete;
    SimBoard& operator=(const SimBoard&) = delete;

    // ---- time -----------------------------------------------------------------------------------
    [[nodiscard]] Instant now() override {
        loop_.before_poll(ApiCall::now);
        return loop_.now();
    }
    void busy_until(Instant t) override { loop_.busy_until(t); }
    void busy_for(Nanoseconds length) override { loop_.busy_until(loop_.now() + length); }
    void sleep_until(Instant t) override { loop_.sleep_until(t); }
    /// Consumes `amount` of the calling VCPU's CPU time: unlike busy_until, not until an instant,
    /// so that time taken by others does not count. For tests and models of load.
    void compute(Nanoseconds amount) { loop_.compute(amount); }

    // ---- pins and buses -------------------------------------------------------------------------
    [[nodiscard]] Result<void> pin_mode(PinId pin, PinMode mode) override {
        return pins_.set_mode(pin, mode);
    }
    void pin_write(PinId pin, Level level) override { pins_.write(pin, level); }
    /// An output reads back what was written; an input what the outside drives.
    [[nodiscard]] Level pin_read(PinId pin) override { return pins_.read(pin); }
    [[nodiscard]] Result<void> safe_state(PinId pin, Level level) override {
        return pins_.set_safe_state(pin, level);
    }
    [[nodiscard]] Result<void> pwm_write(PinId pin, double duty) override {
        return pins_.write_pwm(pin, duty);
    }
    [[nodiscard]] Result<void> pwm_period(PinId pin, Nanoseconds period) override {
        return pins_.set_pwm_period(pin, period);
    }
    [[nodiscard]] Result<double> analog_read(PinId pin) override { return pins_.read_analog(pin); }
    [[nodiscard]] Result<void> attach_edge(PinId pin, Edge edge, EdgeHandler handler, void* context,
                                           VcpuId io) override {
        return pins_.attach(pin, edge, handler, context, io);
    }
    void detach_edge(PinId pin) override { pins_.detach(pin); }
    [[nodiscard]] Result<void> i2c_transfer(I2cBus bus, I2cAddress address, std::span<const std::uint8_t> out,
                                            std::span<std::uint8_t> in) override {
        return pins_.transfer(bus, address, out, in);
    }
    [[nodiscard]] Result<void> spi_transfer(SpiBus bus, SpiSettings settings,
                                            std::span<std::uint8_t> data) override {
        return pins_.transfer(bus, settings, data);
    }

    // ---- locks ----------------------------------------------------------------------------------
    void lock(LockWord& word) override { locks_.lock(word); }
    [[nodiscard]] bool try_lock(LockWord& word) override { return locks_.try_lock(word); }
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
    void request_stop() override { loop_.request_stop(); }
    [[nodiscard]] bool stop_requested() override {
        loop_.before_poll(ApiCall::now);
        return loop_.stop_requested();
    }
    /// All entries have returned, after a stop was requested: the pins are in their safe states.
    [[nodiscard]] bool stopped() const { return loop_.stopped(); }
    /// Forces every pin that has a safe state to it, as the supervisor of a real machine would.
    void force_safe_states() { pins_.force_safe_states(); }
    [[nodiscard]] GuaranteeReport guarantee() const override;
    /// What SimConfig takes of `core`: context switches, interrupts at their mean rate, the tick.
    [[nodiscard]] sched::PlatformOverheads platform_overheads(int core) override;
    /// Bottom halves of `device` become the work of I/O VCPU `io`; kNoVcpu: they run at once, above
    /// every loop.
    Result<void> serve_interrupts(DeviceClass device, VcpuId io) override;
    /// Routes a device class's interrupts away from `core`, to the lowest core that still takes
    /// them, and back. Error: unavailable when no core would take them.
    Result<void> route_interrupts(DeviceClass device, int core, bool allowed) override;
    /// Error: not_permitted when the board runs and no loop owns the core.
    Result<void> core_timer(int core, bool enabled) override;
    void note_release() override { loop_.note(TraceKind::release); }
    void note_overrun() override { loop_.note(TraceKind::overrun); }
    /// A body that let no time pass since it last returned is charged SimConfig::body_cost.
    void note_body_end() override { loop_.note_body_end(); }

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
    /// Time that top halves and shared bottom halves took from `core`.
    [[nodiscard]] Nanoseconds stolen_time(int core) const { return loop_.cpus().core(core).stolen_total(); }

  private:
    SimConfig config_;
    EventLoop loop_;
    SimPins pins_;
    SimLocks locks_{loop_};
};

}  // namespace qduino::board::sim
