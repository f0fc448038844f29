// Real pins: lines of the kernel's GPIO chips, through the v2 character-device interface
// (linux/gpio.h).
//
// Each pin is one line request, so loops that drive different pins share nothing. A write is one
// ioctl.
#pragma once

#include <array>
#include <atomic>
#include <string>

#include "base/result.h"
#include "board/linux/kernel/linux_config.h"
#include "board/linux/pin/pin_driver.h"
#include "board/window/edge_times.h"
#include "posix/unique_fd.h"

namespace qduino::board::linux {

class GpioPin final : public PinDriver {
  public:
    explicit GpioPin(GpioLine line) : line_(line) {}

    /// Requests the line as an input. Error: not_found, not_permitted, or unavailable (somebody
    /// else has the line).
    Result<void> open();

    Result<void> set_mode(VcpuId vcpu, PinId pin, PinMode mode) override;
    void write(VcpuId vcpu, PinId pin, Level level) override;
    Level read(VcpuId vcpu, PinId pin) override;
    Result<void> set_safe_state(PinId pin, Level level) override;
    void force_safe_states() override;
    Result<void> watch_edges(PinId pin, Edge edge) override;
    EdgeCounts edges(PinId pin) override;
    Instant edge_instant(PinId pin, Level to, std::uint32_t number) override;
    int edge_descriptor(PinId) override { return fd_.get(); }

    [[nodiscard]] const GpioLine& line() const { return line_; }

  private:
    [[nodiscard]] std::string name() const;
    Result<void> configure(std::uint64_t flags);

    GpioLine line_;
    posix::UniqueFd fd_;
    PinMode mode_ = PinMode::input;
    std::atomic<Level> latch_{Level::low};
    bool watching_ = false;
    EdgeCounts counts_;
    EdgeTimes rising_times_;
    EdgeTimes falling_times_;
    std::atomic<int> safe_{-1};  // −1: none; else the level
};

/// Takes over a line that a dead sketch has let go of, and drives it to `level` as long as the
/// descriptor lives. Not valid when the line cannot be had. For processes that outlive the sketch.
posix::UniqueFd take_over_line(unsigned chip, unsigned line, Level level);

}  // namespace qduino::board::linux
