// The sketch's side of the virtual hardware (pins_layout.h): pins and buses as drivers of the Linux
// board.
//
// It has more functions than other classes, for it is both halves of the seam that a driver serves:
// pins and buses.
#pragma once

#include <array>
#include <mutex>
#include <span>
#include <string>

#include "base/contract.h"
#include "base/result.h"
#include "board/linux/pin/pin_driver.h"
#include "board/linux/pin/pin_writer.h"
#include "board/linux/pin/pins_file.h"

namespace qduino::board::linux {

/// One per sketch process. Calls of one VCPU come from one thread; VcpuId 0 (setup and other
/// threads) may be several threads, which share its ring and mailbox under a mutex; loops share
/// nothing.
class VirtualPins final : public PinDriver, public I2cDriver, public SpiDriver {
  public:
    VirtualPins() = default;

    /// Attaches to the machine's file as its only sketch. Setup-time. Errors: PinsFile::open.
    Result<void> attach(const std::string& path);
    [[nodiscard]] bool attached() const { return file_.valid(); }

    /// Gives `vcpu` a ring of its own; must come before its first write. `wide` asks for one of the
    /// few large rings (a narrow one when those are taken). Setup-time.
    Result<void> open_writer(VcpuId vcpu, bool wide);

    /// Call before a write of `vcpu` that must be quick, on its own thread: see
    /// PinWriter::rehearse().
    void rehearse_write(VcpuId vcpu) {
        if (writers_[vcpu].is_open()) writers_[vcpu].rehearse();
    }

    // ---- PinDriver ------------------------------------------------------------------------------
    /// For inputs, waits until the machine has published the pin's level once. Error: timed_out
    /// when no machine answers.
    Result<void> set_mode(VcpuId vcpu, PinId pin, PinMode mode) override;
    void write(VcpuId vcpu, PinId pin, Level level) override;
    void write_all(VcpuId vcpu, std::span<const PinId> pins, Level level) override;
    Level read(VcpuId vcpu, PinId pin) override;
    Result<void> write_pwm(VcpuId vcpu, PinId pin, double duty) override;
    Result<void> set_pwm_period(VcpuId vcpu, PinId pin, Nanoseconds period) override;
    [[nodiscard]] Result<double> read_analog(VcpuId vcpu, PinId pin) override;
    Result<void> set_safe_state(PinId pin, Level level) override;
    void force_safe_states() override;
    Result<void> watch_edges(PinId pin, Edge edge) override;
    EdgeCounts edges(PinId pin) override;
    /// When the machine published it.
    Instant edge_instant(PinId pin, Level to, std::uint32_t number) override;

    // ---- buses: each call waits for the machine's answer, at most kBusTimeout -------------------
    /// Error: what the chip answered; timed_out when no machine does; out_of_range above kMailBytes
    /// either way.
    Result<void> transfer(VcpuId vcpu, I2cBus bus, I2cAddress address, std::span<const std::uint8_t> out,
                          std::span<std::uint8_t> in) override;
    Result<void> transfer(VcpuId vcpu, SpiBus bus, SpiSettings settings,
                          std::span<std::uint8_t> data) override;

    // ---- inputs that change ---------------------------------------------------------------------
    /// Counts changes of any input pin; see wait_input_change().
    [[nodiscard]] std::uint32_t input_changes() const;
    /// Sleeps until input_changes() differs from `seen` or until `deadline`.
    void wait_input_change(std::uint32_t seen, Instant deadline);
    /// Wakes everybody in wait_input_change(): for a stop.
    void wake_input_waiters();

    // ---- being watched --------------------------------------------------------------------------
    /// Promises that `vcpu` will be heard of again by `expected_by`. One relaxed store.
    void promise(VcpuId vcpu, Instant expected_by);
    /// The same, where that is later than what was promised. By the thread of `vcpu`.
    void prolong(VcpuId vcpu, Instant expected_by);
    /// Promises that `vcpu` (kNoVcpu: setup()) will have made progress by `by`, which is `limit`
    /// after it made some; kEpoch: it promises nothing.
    void promise_progress(VcpuId vcpu, Instant by, Nanoseconds limit);
    /// Publishes where this loop runs, to find out later why it did not (core_rivals.h).
    /// Setup-time.
    void publish_place(VcpuId vcpu, LoopPlace place);
    /// The supervisor's shortest bound; zero when there is no supervisor.
    [[nodiscard]] Nanoseconds heartbeat_bound() const;
    /// Publishes the kernel line behind a pin, so that the supervisor can take it over
    /// (OutputPin::line).
    void publish_line(PinId pin, ChipPlace line);
    /// The same for a kernel PWM channel.
    void publish_channel(PinId pin, ChipPlace channel);
    /// Records a safe state for the supervisor without being the pin's driver (real pins).
    void publish_safe_state(PinId pin, Level level);

    /// Edges lost because a ring was full.
    [[nodiscard]] std::uint64_t lost_edges() const;
    [[nodiscard]] PinsLayout& layout() const { return file_.layout(); }

  private:
    /// Sets the pin's latch. False: nothing is driven.
    bool latch(PinId pin, Level level);
    [[nodiscard]] PinWriter& writer_of(VcpuId vcpu) {
        QDUINO_EXPECT(vcpu < kVcpuLimit && writers_[vcpu].is_open());
        return writers_[vcpu];
    }
    /// Calls `write` with the writer of `vcpu`.
    template <typename Write>
    void with_writer(VcpuId vcpu, Write write) {
        if (vcpu == kNoVcpu) return with_shared_writer(write);
        write(writer_of(vcpu));
    }
    /// Threads that are no VCPU share one writer, in turns. Not inlined: a VCPU's write is quicker
    /// without it.
    template <typename Write>
    [[gnu::noinline]] void with_shared_writer(Write write) {
        const std::lock_guard lock{shared_by_non_vcpus_};
        write(writer_of(kNoVcpu));
    }
    Result<void> ask(VcpuId vcpu, MailHead head, std::span<const std::uint8_t> out,
                     std::span<std::uint8_t> in, double* analog);

    PinsFile file_;
    std::array<PinWriter, kVcpuLimit> writers_;
    PinWriter will_;
    std::mutex shared_by_non_vcpus_;
};

/// Forces the pins with a safe state in `layout` through `writer`: PWM off, level as asked, and the
/// latches say so. Used by a dying sketch and by the supervisor. Async-signal-safe. Returns how
/// many pins were forced.
int force_safe_states(PinsLayout& layout, PinWriter& writer);

}  // namespace qduino::board::linux
