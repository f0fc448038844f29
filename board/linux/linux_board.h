// The Linux board: a sketch's loops as pinned real-time threads of a stock kernel.
//
//   core 0                          core 1
//   loop 3  1/8 ms   prio 79  ███·····███·····     loop 2  100/100 µs  prio 80 (owns the core)
//   ████████████████ loop 1  30/100   prio 78  ···█████···█████
//
// Each VCPU is a thread on its core at SCHED_FIFO, the shorter its period the higher. Its budget is kept by
// the thread itself (budget_keeper.h) with sched/'s sporadic server as the accountant. Pins and buses are
// drivers (pin_driver.h): virtual ones in shared memory, or the kernel's. Nothing here needs privileges: what
// the system refuses is in the guarantee report, with the fix.
//
// The clock is CLOCK_MONOTONIC, so that instants mean the same in the machine's, the supervisor's and the
// sketch's process.
//
// Who may call what: board.h. One board per process: it owns the signal handlers and the process's memory
// locking.
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/result.h"
#include "board/board.h"
#include "board/linux/clock.h"
#include "board/linux/core_lock.h"
#include "board/linux/core_probe.h"
#include "board/linux/cycle_clock.h"
#include "board/linux/death_witness.h"
#include "board/linux/fatal_signals.h"
#include "board/linux/isolation.h"
#include "board/linux/linux_config.h"
#include "board/linux/machine_settings.h"
#include "board/linux/pin_driver.h"
#include "board/linux/vcpu_thread.h"
#include "board/linux/virtual_pins.h"
#include "posix/unique_fd.h"
#include "sched/admission.h"

namespace qduino::board::linux {

class LinuxBoard final : public Board {
  public:
    /// Opens every device that `config` names. Error: the first that cannot be had, by name.
    static Result<std::unique_ptr<LinuxBoard>> open(LinuxConfig config);
    /// Requests a stop, waits for the loops, forces the safe states.
    ~LinuxBoard();
    LinuxBoard(const LinuxBoard&) = delete;
    LinuxBoard& operator=(const LinuxBoard&) = delete;

    // ---- time -------------------------------------------------------------------------------------------
    [[nodiscard]] int core_count() const override { return core_count_; }
    [[nodiscard]] Instant now() override { return cycle_clock.now(); }
    /// Spins. Late by one reading of the clock (10 to 25 ns) when nothing takes the core away.
    void busy_until(Instant t) override;
    /// The same for a length, from the call to the return: what the call itself takes is part of it.
    void busy_for(Nanoseconds length) override;
    void sleep_until(Instant t) override;
    [[nodiscard]] VcpuId current_vcpu() const override { return VcpuThread::current_id(); }

    // ---- pins and buses ---------------------------------------------------------------------------------
    Result<void> pin_mode(PinId pin, PinMode mode) override;
    void pin_write(PinId pin, Level level) override;
    [[nodiscard]] Level pin_read(PinId pin) override;
    Result<void> pwm_write(PinId pin, double duty) override;
    Result<void> pwm_period(PinId pin, Nanoseconds period) override;
    [[nodiscard]] Result<double> analog_read(PinId pin) override;
    Result<void> i2c_transfer(I2cBus bus, I2cAddress address, std::span<const std::uint8_t> out,
                              std::span<std::uint8_t> in) override;
    Result<void> spi_transfer(SpiBus bus, SpiSettings settings, std::span<std::uint8_t> data) override;
    Result<void> safe_state(PinId pin, Level level) override;

    // ---- locks: linux_board_locks.cpp -------------------------------------------------------------------
    void lock(LockWord& word) override;
    [[nodiscard]] bool try_lock(LockWord& word) override;
    void unlock(LockWord& word) override;

    // ---- interrupts -------------------------------------------------------------------------------------
    Result<void> attach_edge(PinId pin, Edge edge, EdgeHandler handler, void* context, VcpuId io) override;
    void detach_edge(PinId pin) override;
    /// The kernel threads that do the bottom halves of `device` (threaded interrupts, threaded NAPI) get the
    /// priority and core of I/O VCPU `io` when the board starts. Where the kernel has none, and that their
    /// budget is not enforced, is said in the guarantee. Setup-time.
    Result<void> serve_interrupts(DeviceClass device, VcpuId io) override;
    /// Routes the interrupts of a device class away from `core`, or lets them come there as well. Undone at
    /// the end. Setup-time. Errors: not_permitted (needs root), not_found (the class has no interrupts here),
    /// unavailable.
    Result<void> route_interrupts(DeviceClass device, int core, bool allowed) override;
    /// The tick of a core stops by itself while its owner runs alone, if the kernel was booted so. Error:
    /// unsupported (not booted with nohz_full for this core); for `enabled` on such a core as well.
    Result<void> core_timer(int core, bool enabled) override;
    /// What wake-up and enforcement cost here: measured once, at the first call (some 10 ms). Setup-time.
    [[nodiscard]] sched::PlatformOverheads platform_overheads(int core) override;

    // ---- running ----------------------------------------------------------------------------------------
    /// Makes the threads and lets them go all at once. An I/O VCPU without an entry runs the handlers
    /// attached to it. Errors: invalid_argument (a spec is malformed), out_of_range (a budget below
    /// kShortestSharedBudget on a core that others use: give the loop a core of its own), unavailable (no
    /// thread to be had; a core to be owned is another sketch's: who that is). Nothing runs after an error.
    Result<void> start(std::span<const VcpuSpec> specs) override;
    /// Returns when a stop was requested and all loops have returned (then the safe states have been forced),
    /// or at `until`.
    void run(Instant until) override;
    /// Async-signal-safe.
    void request_stop() override;
    [[nodiscard]] bool stop_requested() override { return stop_.load(std::memory_order_acquire); }
    [[nodiscard]] GuaranteeReport guarantee() const override;

    // ---- what this board has besides --------------------------------------------------------------------
    /// The calling loop begins a release: what the supervisor takes for a sign of life.
    void note_release() override;
    /// Forces all safe states now. Async-signal-safe, once per board.
    void force_safe_states();
    /// Edges lost on the way to a virtual machine.
    [[nodiscard]] std::uint64_t lost_edges() const;

    /// On a core that several VCPUs share, enforcing a smaller budget costs more than the budget.
    static constexpr Nanoseconds kShortestSharedBudget = 100us;

  private:
    static constexpr std::size_t kBusLimit = 16;

    struct EdgeWatch {
        std::atomic<EdgeHandler> handler{nullptr};
        void* context = nullptr;
        Edge edge = Edge::both;
        VcpuId io = kNoVcpu;
        EdgeCounts seen;  // the VCPU's own
    };

    explicit LinuxBoard(LinuxConfig config) : config_(std::move(config)) {}
    Result<void> open_devices();
    Result<void> open_real_pins();
    Result<void> open_real_buses();
    template <typename Driver>
    Result<void> add_pin(PinId pin, std::unique_ptr<Driver> driver);
    [[nodiscard]] PinDriver* driver_of(PinId pin) const;
    Result<void> check(std::span<const VcpuSpec> specs) const;
    [[nodiscard]] int priority_of(const VcpuSpec& spec, std::span<const VcpuSpec> all) const;
    void serve_edges(VcpuId io);
    void run_handlers(VcpuId io);
    void wait_for_edges(VcpuId io, std::uint32_t seen);
    static void edge_entry(void* board);
    Result<void> open_settings();
    Result<void> lock_cores(std::span<const VcpuSpec> specs);
    void take_cores(std::span<const VcpuSpec> specs);
    void schedule_bottom_halves(std::span<const VcpuSpec> specs);
    Result<void> make_threads(std::span<const VcpuSpec> specs);
    [[nodiscard]] LoopGuarantee guarantee_of(const VcpuThread& thread) const;
    [[nodiscard]] CoreGuarantee guarantee_of_core(int core) const;
    void promise_until(Instant t);
    void open_gate(std::uint32_t state);
    [[nodiscard]] bool all_returned() const;

    LinuxConfig config_;
    int core_count_ = 1;
    VirtualPins virtual_;
    DeathWitness witness_;  // before everything that could end it: dismissed by hand, in the destructor
    std::vector<std::unique_ptr<PinDriver>> real_pins_;
    std::vector<std::unique_ptr<I2cDriver>> real_i2c_;
    std::vector<std::unique_ptr<SpiDriver>> real_spi_;
    std::array<PinDriver*, kPinCount> pins_{};  // what is behind each pin; null: nothing
    std::array<I2cDriver*, kBusLimit> i2c_{};
    std::array<SpiDriver*, kBusLimit> spi_{};
    std::array<EdgeWatch, kPinCount> watches_;
    std::unique_ptr<FatalSignals> signals_;

    /// A core that VCPUs run on.
    struct UsedCore {
        int core = 0;
        bool owned = false;
        std::optional<CoreProbe> probe;  // of an owned core, before its loop began
        std::optional<std::uint64_t> interrupts_at_start;
    };

    std::vector<CoreLock> core_locks_;  // before the settings: given up after they are undone
    FixedString<200> lock_shortfall_;
    MachineSettings settings_;  // open once something was changed; undoes it
    Isolation isolation_;
    posix::UniqueFd awake_;  // keep_cores_awake()
    FixedString<200> isolation_shortfall_;
    std::vector<UsedCore> cores_;
    Instant started_at_{};
    std::array<VcpuId, kDeviceClassCount> served_by_{};
    std::array<FixedString<160>, kDeviceClassCount> served_note_;
    std::optional<sched::PlatformOverheads> overheads_;

    std::vector<std::unique_ptr<VcpuThread>> threads_;
    std::atomic<bool> stop_{false};
    std::atomic<std::uint32_t> returned_{0};  // futex of run(): a loop has returned, or a stop was requested
    std::unique_ptr<StartGate> gate_;
    std::atomic<bool> made_safe_{false};
    bool watched_ = false;  // a supervisor wants heartbeats
    Nanoseconds heartbeat_bound_{};
    bool memory_locked_ = false;
};

}  // namespace qduino::board::linux
