// The drivers behind a pin or a bus on the Linux board: virtual devices in shared memory, or the
// kernel's real ones.
//
//   LinuxBoard ──► PinDriver   VirtualPins · GpioPin · PwmPin · AnalogPin · NoPin
//              ──► I2cDriver   VirtualPins · I2cDevice
//              ──► SpiDriver   VirtualPins · SpiDevice
//
// The board gives each pin its driver once, when it opens. A call costs one indirect jump.
#pragma once

#include <span>

#include "base/result.h"
#include "board/types.h"

namespace qduino::board::linux {

/// Edges that a pin has seen so far; counts wrap.
struct EdgeCounts {
    std::uint32_t rising = 0;
    std::uint32_t falling = 0;
};

/// The error for what the pin of a driver cannot do.
inline Error pin_cannot(std::string_view what) {
    return make_error(ErrorCode::unsupported, "this pin has no ", what,
                      ": use another pin, or name a device for it");
}

/// Real-time safe after set_mode(), unless a driver says otherwise. `vcpu` is the caller.
class PinDriver {
  public:
    virtual ~PinDriver() = default;
    virtual Result<void> set_mode(VcpuId vcpu, PinId pin, PinMode mode) = 0;  ///< setup-time
    virtual void write(VcpuId vcpu, PinId pin, Level level) = 0;
    /// Writes pins that are all this driver's, at one instant where it can.
    virtual void write_all(VcpuId vcpu, std::span<const PinId> pins, Level level) {
        for (const PinId pin : pins) write(vcpu, pin, level);
    }
    [[nodiscard]] virtual Level read(VcpuId vcpu, PinId pin) = 0;
    virtual Result<void> write_pwm(VcpuId, PinId, double) { return pin_cannot("PWM"); }
    /// `period`: see is_pwm_period(). Setup-time.
    virtual Result<void> set_pwm_period(VcpuId, PinId, Nanoseconds) { return pin_cannot("PWM"); }
    [[nodiscard]] virtual Result<double> read_analog(VcpuId, PinId) { return pin_cannot("analog input"); }
    /// Counts these edges from now on (others may be counted, too). Setup-time.
    virtual Result<void> watch_edges(PinId, Edge) { return pin_cannot("interrupts"); }
    /// Edges counted so far. From one thread.
    [[nodiscard]] virtual EdgeCounts edges(PinId) { return {}; }
    /// When rising (falling) edge `number` of them came, counted from 1; kForever: nobody knows.
    /// From the same thread, after edges().
    [[nodiscard]] virtual Instant edge_instant(PinId, Level, [[maybe_unused]] std::uint32_t number) {
        return kForever;
    }
    /// Becomes readable when edges() would change. −1: no descriptor;
    /// VirtualPins::wait_input_change() tells instead.
    [[nodiscard]] virtual int edge_descriptor(PinId) { return -1; }
    /// Remembers the level that the pin is forced to. Setup-time.
    virtual Result<void> set_safe_state(PinId pin, Level level) = 0;
    /// Forces every pin with a safe state. Async-signal-safe, at most once per process.
    virtual void force_safe_states() = 0;
};

/// The driver of a pin with nothing behind it: reads low.
class NoPin final : public PinDriver {
  public:
    Result<void> set_mode(VcpuId, PinId pin, PinMode) override { return nothing_at(pin); }
    void write(VcpuId, PinId, Level) override {}
    Level read(VcpuId, PinId) override { return Level::low; }
    Result<void> write_pwm(VcpuId, PinId pin, double) override { return nothing_at(pin); }
    Result<void> set_pwm_period(VcpuId, PinId pin, Nanoseconds) override { return nothing_at(pin); }
    Result<double> read_analog(VcpuId, PinId pin) override { return nothing_at(pin); }
    Result<void> watch_edges(PinId pin, Edge) override { return nothing_at(pin); }
    Result<void> set_safe_state(PinId pin, Level) override { return nothing_at(pin); }
    void force_safe_states() override {}

  private:
    static Error nothing_at(PinId pin) {
        return make_error(ErrorCode::invalid_argument, "pin ", pin.number,
                          " is connected to nothing: name its line, or use virtual pins");
    }
};

/// This class itself is the bus that is connected to nothing.
class I2cDriver {
  public:
    virtual ~I2cDriver() = default;
    virtual Result<void> transfer(VcpuId, I2cBus, I2cAddress, std::span<const std::uint8_t>,
                                  std::span<std::uint8_t>) {
        return make_error(ErrorCode::unsupported, "this I2C bus is connected to nothing");
    }
};
/// This class, too, is the bus that is connected to nothing.
class SpiDriver {
  public:
    virtual ~SpiDriver() = default;
    virtual Result<void> transfer(VcpuId, SpiBus, SpiSettings, std::span<std::uint8_t>) {
        return make_error(ErrorCode::unsupported, "this SPI bus is connected to nothing");
    }
};

}  // namespace qduino::board::linux
