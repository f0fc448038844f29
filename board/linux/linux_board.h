// The Linux board: a sketch's loops as pinned real-time threads of a stock kernel.
//
//   core 0                          core 1
//   loop 3  1/8 ms   prio 79  ███·····███·····     loop 2  100/100 µs  prio 80 (owns the core)
//   ████████████████ loop 1  30/100   prio 78  ···█████···█████
//
// Each VCPU is a thread on its core at SCHED_FIFO, the shorter its period the higher. Its budget is
// kept by the thread itself (budget_keeper.h), with sched/'s sporadic server as the accountant, and
// by a process beside the sketch when the thread does not (warden.h). Pins and buses are drivers
// (pin_driver.h): virtual ones in shared memory, or the kernel's. Nothing here needs privileges:
// what the system refuses is in the guarantee report, with the fix.
//
// The clock is CLOCK_MONOTONIC, so that instants mean the same in the machine's, the supervisor's
// and the sketch's process.
//
// The board has more functions than other classes, for it is the seam's whole list, and forwards:
//
//   PinTable    drivers, safe states           CoreTaker  what is done to the computer; guarantee
//   EdgeServer  handlers on I/O VCPUs          Crew       threads: gate, run, stop
//   SignsOfLife for the supervisor                pi_lock.cpp  locks
//   Warden      keeps those to their budgets that escape
//   DelayWitness  who took the core of a loop that was late
//
// board.h says when each call may be made. One board per process: it owns the signal handlers and
// the process's memory locking.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/result.h"
#include "board/board.h"
#include "board/linux/computer/delay_witness.h"
#include "board/linux/computer/loop_promise.h"
#include "board/linux/computer/standstill.h"
#include "board/linux/core_taker.h"
#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/cycle_clock.h"
#include "board/linux/kernel/fatal_signals.h"
#include "board/linux/kernel/linux_config.h"
#include "board/linux/loop/crew.h"
#include "board/linux/loop/edge_server.h"
#include "board/linux/loop/warden.h"
#include "board/linux/pin/death_witness.h"
#include "board/linux/pin/pin_table.h"
#include "board/linux/pin/signs_of_life.h"

namespace qduino::board::linux {

/// An I/O VCPU as another process must know it.
struct ServingVcpu {
    VcpuSpec spec;
    int priority = 0;  ///< SCHED_FIFO; 0: it could not be had
};

class LinuxBoard final : public Board {
  public:
    /// Opens every device that `config` names. Error: the first that cannot be had, by name.
    static Result<std::unique_ptr<LinuxBoard>> open(LinuxConfig config);
    /// Requests a stop, waits for the loops, forces the safe states.
    ~LinuxBoard();
    LinuxBoard(const LinuxBoard&) = delete;
    LinuxBoard& operator=(const LinuxBoard&) = delete;

    // ---- time -----------------------------------------------------------------------------------
    [[nodiscard]] Instant now() override { return cycle_clock.now(); }
    /// Spins. Late by one reading of the clock (10 to 25 ns) when nothing takes the core away.
    void busy_until(Instant t) override;
    void busy_for(Nanoseconds length) override;
    void sleep_until(Instant t) override;

    // ---- pins and buses -------------------------------------------------------------------------
    Result<void> pin_mode(PinId pin, PinMode mode) override {
        return pins_.at(pin).set_mode(current_vcpu(), pin, mode);
    }
    void pin_write(PinId pin, Level level) override { pins_.at(pin).write(current_vcpu(), pin, level); }
    /// Virtual pins: at one instant. Lines of the kernel's chips are asked for one by one.
    void pins_write(std::span<const PinId> pins, Level level) override {
        pins_.write(current_vcpu(), pins, level);
    }
    [[nodiscard]] Level pin_read(PinId pin) override { return pins_.at(pin).read(current_vcpu(), pin); }
    Result<void> safe_state(PinId pin, Level level) override { return pins_.set_safe_state(pin, level); }
    Result<void> pwm_write(PinId pin, double duty) override {
        return pins_.at(pin).write_pwm(current_vcpu(), pin, duty);
    }
    Result<void> pwm_period(PinId pin, Nanoseconds period) override {
        if (!is_pwm_period(period)) return bad_pwm_period();
        return pins_.at(pin).set_pwm_period(current_vcpu(), pin, period);
    }
    [[nodiscard]] Result<double> analog_read(PinId pin) override {
        return pins_.at(pin).read_analog(current_vcpu(), pin);
    }
    /// The kernel's first thermal zone. Error: the system's, when there is none.
    [[nodiscard]] Result<double> chip_temperature() override;
    Result<void> attach_edge(PinId pin, Edge edge, EdgeHandler handler, void* context, VcpuId io) override {
        return edges_.attach(pin, edge, handler, context, io);
    }
    void detach_edge(PinId pin) override { edges_.detach(pin); }
    Result<void> i2c_transfer(I2cBus bus, I2cAddress address, std::span<const std::uint8_t> out,
                              std::span<std::uint8_t> in) override {
        return pins_.at(bus).transfer(current_vcpu(), bus, address, out, in);
    }
    Result<void> spi_transfer(SpiBus bus, SpiSettings settings, std::span<std::uint8_t> data) override {
        return pins_.at(bus).transfer(current_vcpu(), bus, settings, data);
    }

    // ---- locks: pi_lock.cpp ---------------------------------------------------------------------
    void lock(LockWord& word) override;
    [[nodiscard]] bool try_lock(LockWord& word) override;
    void unlock(LockWord& word) override;

    // ---- VCPUs ----------------------------------------------------------------------------------
    [[nodiscard]] int core_count() const override { return core_count_; }
    [[nodiscard]] VcpuId current_vcpu() const override { return VcpuThread::current_id(); }
    /// Makes the threads and lets them go all at once. An I/O VCPU without an entry runs the
    /// handlers attached to it. Errors: invalid_argument (a spec is malformed), out_of_range (a
    /// budget below kShortestSharedBudget on a core that others use: give the loop a core of its
    /// own), unavailable (no thread to be had; a core to be owned is another sketch's: who that
    /// is). Nothing runs after an error.
    Result<void> start(std::span<const VcpuSpec> specs) override;
    /// When all loops have returned, the safe states have been forced.
    void run(Instant until) override;
    /// Async-signal-safe.
    void request_stop() override;
    [[nodiscard]] bool stop_requested() override { return crew_.stop().load(std::memory_order_acquire); }
    [[nodiscard]] GuaranteeReport guarantee() const override;
    /// The kernel threads that do the bottom halves of `device` (threaded interrupts, threaded
    /// NAPI) get the priority and core of I/O VCPU `io` when the board starts. Where the kernel has
    /// none, and that their budget is not enforced, is said in the guarantee. Setup-time.
    Result<void> serve_interrupts(DeviceClass device, VcpuId io) override {
        cores_.serve_interrupts(device, io);
        return {};
    }
    /// The I/O VCPU that serves `device`, as it runs: for a process that does its bottom half.
    /// Nothing: none serves it. After start().
    [[nodiscard]] std::optional<ServingVcpu> serving(DeviceClass device) const;
    /// Its thread, the warden and the promise to other programs take it up by themselves, within
    /// milliseconds.
    Result<void> change_io(VcpuId io, sched::VcpuParameters parameters) override;
    /// Undone at the end. Setup-time. Errors: not_permitted (needs root), not_found (the class has
    /// no interrupts here), unavailable.
    Result<void> route_interrupts(DeviceClass device, int core, bool allowed) override {
        return cores_.route_interrupts(device, core, allowed);
    }
    /// The tick of a core stops by itself while its owner runs alone, if the kernel was booted for
    /// it. Error: unsupported (not booted with nohz_full for this core); for `enabled` on such a
    /// core as well.
    Result<void> core_timer(int core, bool enabled) override { return cores_.core_timer(core, enabled); }
    [[nodiscard]] Instant handler_came() const override {
        const VcpuId io = current_vcpu();
        return io >= kFirstIoVcpu ? edges_.came(io) : kForever;
    }
    [[nodiscard]] Nanoseconds slept() const override {
        const VcpuThread* const self = VcpuThread::current();
        return self ? self->slept() : Nanoseconds{0};
    }
    [[nodiscard]] std::int64_t sleeps() const override {
        const VcpuThread* const self = VcpuThread::current();
        return self ? self->sleeps() : 0;
    }
    /// What wake-up and enforcement cost here: measured once, at the first call (some 25 ms; 0.3 s
    /// where the host takes the core away meanwhile).
    /// Setup-time.
    [[nodiscard]] sched::PlatformOverheads platform_overheads(int core) override;
    /// What the supervisor takes for a sign of life.
    void note_release(Instant nominal) override {
        life_.progressed(current_vcpu());
        if (VcpuThread* const self = VcpuThread::current()) self->begin_release(nominal);
    }
    /// The delay witness wants to know. A loop that owns its core is told on by its spins.
    void note_overrun(Nanoseconds lateness) override {
        VcpuThread* const self = VcpuThread::current();
        if (!self) return;
        self->count_late();
        if (!self->spec().owns_core) self->was_late(lateness);
    }
    void note_body_end() override { life_.progressed(current_vcpu()); }
    void note_setup(bool running) override {
        life_.limit_progress(kNoVcpu, running ? config_.setup_bound : Nanoseconds{0});
        life_.progressed(kNoVcpu);
    }
    void note_progress() override { life_.progressed(current_vcpu()); }
    void promise_progress(VcpuId id, Nanoseconds limit) override {
        life_.limit_progress(id, limit);
        if (id == current_vcpu()) life_.progressed(id);
    }

    /// The kernel's CPU clock of the calling thread: a system call, 0.4 to 1.4 µs (2-core VM).
    [[nodiscard]] Nanoseconds cpu_time() override { return thread_cpu_time(); }
    /// By getrusage(2) and the budget's keeper: a system call as long.
    [[nodiscard]] Incidents incidents() override;

    // ---- what this board has besides ------------------------------------------------------------
    /// Forces all safe states now. Async-signal-safe, once per board.
    void force_safe_states() { pins_.force_safe_states(); }
    /// Every loop has returned.
    [[nodiscard]] bool loops_ended() const { return crew_.all_returned(); }
    /// Before _exit() of a process whose loops have not ended: safe states, and the computer as it
    /// was. Nothing of the board may be destroyed, for the loops may go on.
    void abandon();
    /// Edges lost on the way to a virtual machine.
    [[nodiscard]] std::uint64_t lost_edges() const;

  private:
    explicit LinuxBoard(LinuxConfig config);
    Result<void> open_writers(std::span<const VcpuSpec> specs);
    Result<void> make_threads(std::span<const VcpuSpec> specs);
    Result<void> fill_crew(std::span<const VcpuSpec> specs);
    Result<void> wait_for_crew();
    void hire_warden(std::span<const VcpuSpec> specs);
    void instruct_warden();
    void rank_kernel_threads();
    void renew_promise();
    void look_after_warden();
    static void edge_entry(void* board);
    [[nodiscard]] std::vector<DelayWitness::Ward> loops() const;

    LinuxConfig config_;
    int core_count_;
    PinTable pins_;
    // Before everything that could end it: dismissed by hand, in the destructor.
    DeathWitness witness_;
    SignsOfLife life_;
    EdgeServer edges_{pins_, life_};
    CoreTaker cores_{config_, core_count_};
    Warden warden_;  // outlives its wards, the crew's threads
    FixedString<120> warden_shortfall_;
    FixedString<160> watch_lost_;      // why the loops were told to end
    posix::UniqueFd written_files_;    // of the loops: rules
    Instant began_at_{}, ended_at_{};  // the loops; zero: not yet
    Crew crew_;
    std::unique_ptr<FatalSignals> signals_;
    std::optional<sched::PlatformOverheads> overheads_;
    std::optional<sched::PlatformInterferer> warden_looks_;
    LoopPromise promise_;
    DelayWitness delays_;
    Standstill standstill_;  // of the thread of run()
    CpuList started_on_;     // the cores that this process had at its start
    bool memory_locked_ = false;
};

}  // namespace qduino::board::linux
