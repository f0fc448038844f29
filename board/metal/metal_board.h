// The board without an operating system: sched/ is the kernel's scheduler.
//
//   sketch ─► arduino, runtime ─► MetalBoard ─┬─ cores, threads     core/     one scheduler a core
//                                             ├─ locks              core/locks.h
//                                             ├─ device interrupts  core/device_interrupts.h
//                                             └─ pins               pins.h
//
// It is the seam's list, and forwards: it has more functions than other classes for that reason.
// There is one. start(), run() and the constructor belong to the host (core/core.h); every other
// call may also come from VCPUs (board.h).
#pragma once

#include <atomic>
#include <span>

#include "board/board.h"
#include "board/metal/computer/clock.h"
#include "board/metal/core/kernel.h"
#include "board/metal/core/locks.h"
#include "board/metal/pins.h"

namespace qduino::board::metal {

class MetalBoard final : public Board {
  public:
    MetalBoard();

    // ---- time -----------------------------------------------------------------------------------
    [[nodiscard]] Instant now() override { return computer_clock.now(); }
    void busy_until(Instant t) override;
    void busy_for(Nanoseconds length) override { busy_until(now() + length); }
    /// From now on most of a spin is counted. To read its clock, and to take the hint that it
    /// spins, costs an emulator a thousand instructions. By the host, before start().
    void count_spins();
    /// Where the core's timer is off (noTimer()), nothing could wake the caller: there it spins.
    void sleep_until(Instant t) override;

    // ---- pins -----------------------------------------------------------------------------------
    Result<void> pin_mode(PinId pin, PinMode mode) override { return pins.set_mode(pin, mode); }
    void pin_write(PinId pin, Level level) override { pins.write(pin, level); }
    [[nodiscard]] Level pin_read(PinId pin) override { return pins.read(pin); }
    Result<void> safe_state(PinId pin, Level level) override { return pins.set_safe_level(pin, level); }
    Result<void> attach_edge(PinId pin, Edge edge, EdgeHandler handler, void* context, VcpuId io) override {
        return pins.attach(pin, edge, handler, context, io);
    }
    void detach_edge(PinId pin) override { pins.detach(pin); }
    Result<void> pwm_write(PinId pin, double duty) override { return pins.write_pwm(pin, duty); }
    Result<void> pwm_period(PinId pin, Nanoseconds period) override {
        return pins.set_pwm_period(pin, period);
    }
    [[nodiscard]] Result<double> analog_read(PinId pin) override { return pins.read_analog(pin); }

    // ---- buses ----------------------------------------------------------------------------------
    Result<void> i2c_transfer(I2cBus bus, I2cAddress address, std::span<const std::uint8_t> out,
                              std::span<std::uint8_t> in) override {
        QDUINO_TRY_ASSIGN(Peripherals* const wired, pins.wired());
        return wired->i2c_transfer(now(), bus, address, out, in);
    }
    Result<void> spi_transfer(SpiBus bus, SpiSettings settings, std::span<std::uint8_t> data) override {
        QDUINO_TRY_ASSIGN(Peripherals* const wired, pins.wired());
        return wired->spi_transfer(now(), bus, settings, data);
    }

    // ---- locks ----------------------------------------------------------------------------------
    void lock(LockWord& word) override { locks.lock(word); }
    [[nodiscard]] bool try_lock(LockWord& word) override { return locks.try_lock(word); }
    void unlock(LockWord& word) override { locks.unlock(word); }

    // ---- VCPUs ----------------------------------------------------------------------------------
    [[nodiscard]] int core_count() const override { return metal::core_count(); }
    [[nodiscard]] VcpuId current_vcpu() const override { return running_vcpu(); }
    [[nodiscard]] Instant handler_came() const override;
    [[nodiscard]] Nanoseconds slept() const override;
    [[nodiscard]] Nanoseconds cpu_time() override;
    Result<void> start(std::span<const VcpuSpec> specs) override;
    void run(Instant until) override;
    void request_stop() override { stop_.store(true); }
    [[nodiscard]] bool stop_requested() override { return stop_.load(std::memory_order_relaxed); }
    [[nodiscard]] GuaranteeReport guarantee() const override;
    void note_release(Instant nominal) override;

    [[nodiscard]] sched::PlatformOverheads platform_overheads(int core) override;
    Result<void> serve_interrupts(DeviceClass device, VcpuId io) override;
    Result<void> change_io(VcpuId io, sched::VcpuParameters parameters) override;
    /// Rewrites the redirection entries of the devices. Error: unavailable when no core would take
    /// them.
    Result<void> route_interrupts(DeviceClass device, int core, bool allowed) override;
    /// The timer of `core` is not set any more; what sleeps there spins.
    Result<void> core_timer(int core, bool enabled) override;

  private:
    static void thread_main(void* thread);
    Result<void> add_thread(const VcpuSpec& spec, Instant now);
    void end();

    std::atomic<bool> stop_{false}, loops_over_{false};
    std::atomic<int> loops_left_{0};    // entries that have not returned, of loops …
    std::atomic<int> threads_left_{0};  // … and of all VCPUs
    bool runs_ = false, ended_ = false;
    Instant began_ = kForever;   // start(); then the first run()
    Nanoseconds entry_cost_{};   // into the kernel and back
    Nanoseconds switch_cost_{};  // the same with a decision
    // What kTurns of count_down() take, in counts of the clock; 0: nothing is counted.
    std::uint64_t turns_take_ = 0;
};

}  // namespace qduino::board::metal
