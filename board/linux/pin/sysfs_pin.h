// Pins behind the kernel's sysfs: PWM channels and IIO analog inputs. A call is one write or one
// read of an open file.
#pragma once

#include <string>

#include "board/linux/kernel/linux_config.h"
#include "board/linux/pin/pin_driver.h"
#include "posix/unique_fd.h"

namespace qduino::board::linux {

/// PWM made by hardware: /sys/class/pwm/pwmchipN/pwmM. digitalWrite() is duty 0 or 1. The channel
/// is off until pinMode(OUTPUT) or analogWrite(); a level written before that is its first one.
class PwmPin final : public PinDriver {
  public:
    /// `root` precedes /sys (tests).
    PwmPin(PwmChannel channel, std::string root) : channel_(channel), root_(std::move(root)) {}

    /// Exports the channel, switches it off, sets its period and duty 0. Error: not_found,
    /// not_permitted, unavailable.
    Result<void> open();

    Result<void> set_mode(VcpuId, PinId, PinMode mode) override;
    void write(VcpuId, PinId, Level level) override;
    Level read(VcpuId, PinId) override { return duty_ns_ > 0 ? Level::high : Level::low; }
    Result<void> write_pwm(VcpuId, PinId, double duty) override;
    /// Error: the kernel's, for a period that the chip cannot make; the old period then stays.
    Result<void> set_pwm_period(VcpuId, PinId, Nanoseconds period) override;
    Result<void> set_safe_state(PinId, Level level) override;
    void force_safe_states() override;

  private:
    void set_duty(std::int64_t duty_ns);
    Result<void> enable();

    PwmChannel channel_;
    std::string root_;
    posix::UniqueFd duty_file_;
    posix::UniqueFd enable_file_;
    Nanoseconds period_{};
    std::int64_t duty_ns_ = 0;
    bool enabled_ = false;
    int safe_ = -1;  // −1: none; else the level
};

/// Makes a channel safe that a dead sketch has left behind (`period` is not used): duty 0, or the
/// whole period for high. A channel that takes no duty is switched off. False: neither worked. For
/// processes that outlive the sketch.
bool force_pwm_channel(const PwmChannel& channel, const std::string& root, Level level);

/// One channel of an IIO analog-to-digital converter.
class AnalogPin final : public PinDriver {
  public:
    AnalogPin(AnalogChannel channel, std::string root) : channel_(channel), root_(std::move(root)) {}

    Result<void> open();  ///< Error: not_found, not_permitted

    Result<void> set_mode(VcpuId, PinId, PinMode) override { return {}; }
    void write(VcpuId, PinId, Level) override {}
    /// High from half of the scale upwards.
    Level read(VcpuId vcpu, PinId pin) override;
    /// Blocks for one conversion. Error: faulted when the converter gives none.
    Result<double> read_analog(VcpuId, PinId) override;
    Result<void> set_safe_state(PinId, Level) override { return pin_cannot("output"); }
    void force_safe_states() override {}

  private:
    AnalogChannel channel_;
    std::string root_;
    posix::UniqueFd file_;
};

}  // namespace qduino::board::linux
