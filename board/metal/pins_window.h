// A window to a machine outside: a virtual printer, say, that another program plays.
//
//   this computer                      memory of both                   a program outside
//   Pins ─► edges, duties ──────────► rings of each VCPU ─────────────► PinsServer (board/linux)
//        ◄─ inputs ◄───────────────── levels ◄─────────────────────────┤
//   I2C, SPI, analog ─► request ────► mailbox of each VCPU ──────────► │
//                    ◄─ answer ◄──────────────────────────────────────┘
//
// The layout is that of the Linux board's virtual pins (board/window/pins_layout.h), so the same
// program serves both. The memory is that of a PCI device which the emulator makes of a file
// (QEMU's ivshmem-plain, docs/specs/ivshmem-spec.txt there: BAR 2). The device does not interrupt.
// So an answer is looked for every kLook, asleep, and an input has its level but no edges.
//
// Each call may come from any core: a VCPU has its ring and its mailbox alone. The host has those
// of VCPU 0.
#pragma once

#include "board/peripherals.h"
#include "board/window/pins_layout.h"

namespace qduino::board::metal {

class PinsWindow final : public Peripherals {
  public:
    static constexpr Nanoseconds kLook{50'000};
    /// An input is read as it was at most so long ago, however late the program outside is: the
    /// reader waits for it. So a switch stops a motor at the same step every time, as long as the
    /// steps are further apart than that.
    static constexpr Nanoseconds kInputAge{100'000};
    /// How long a request waits. The program outside is no real-time one.
    static constexpr Nanoseconds kPatience = 2s;

    /// Looks for the device, once. False: this computer has none, or none with this layout.
    [[nodiscard]] bool open();
    /// Memory at `address`, laid out so, is the window. False: it is none. Linux is at the other
    /// side then, and an input is read as it was published last: nobody waits for Linux.
    [[nodiscard]] bool open_at(std::uint64_t address);

    // ---- Peripherals. `now` is the caller's own clock ------------------------------------------
    void pin_written(Instant now, PinId pin, Level level) override;
    void pwm_written(Instant now, PinId pin, double duty) override;
    void pwm_period_set(Instant now, PinId pin, Nanoseconds period) override;
    /// Waits until the level is no older than kInputAge; kPatience at most.
    [[nodiscard]] Level pin_level(Instant now, PinId pin) override;
    /// 0 when nobody answers.
    [[nodiscard]] double analog_level(Instant now, PinId pin) override;
    [[nodiscard]] Result<void> i2c_transfer(Instant now, I2cBus bus, I2cAddress address,
                                            std::span<const std::uint8_t> out,
                                            std::span<std::uint8_t> in) override;
    [[nodiscard]] Result<void> spi_transfer(Instant now, SpiBus bus, SpiSettings settings,
                                            std::span<std::uint8_t> data) override;

  private:
    bool open_layout(PinsLayout* layout);
    void push(PinEvent event);
    Result<void> ask(MailHead head, std::span<const std::uint8_t> out, std::span<std::uint8_t> in,
                     std::uint64_t* analog);
    void wait_for_inputs() const;
    [[nodiscard]] NarrowRing& ring_of(int writer) const;

    bool waits_for_inputs_ = true;
    PinsLayout* layout_ = nullptr;  // the head of the device's memory; the rings follow it
};

extern PinsWindow pins_window;

}  // namespace qduino::board::metal
