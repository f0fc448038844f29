// Real pins: registers of the computer whose bits are levels of a connector or of a chip's pads.
//
//   Pins (pins.h) ─► PinPort ─┬─ LptPort                        the parallel port of a PC
//                             ├─ BayTrailPads, ApolloLakePads   Intel's
//                             └─ Pl061                          Arm's GPIO chip
//
// Levels alone: no PWM, no analog input, no bus.
#pragma once

#include <atomic>
#include <cstdint>

#include "base/result.h"
#include "board/types.h"

namespace qduino::board::metal {

/// All calls come with interrupts off, from any core.
class PinPort {
  public:
    /// `level`: an output has it from the beginning. Error: unsupported or not_found, with the
    /// pin's and the mode's names, where the port has no such pin; nothing is changed then.
    [[nodiscard]] virtual Result<void> set_mode(PinId pin, PinMode mode, Level level) = 0;
    /// Only of a pin that set_mode() has taken as an output; another is left as it is.
    virtual void write(PinId pin, Level level) = 0;
    /// The level at the pin; low where the port has no such pin.
    [[nodiscard]] virtual Level read(PinId pin) = 0;
    /// Pins::driven() is called when the level of an input has changed.
    [[nodiscard]] virtual bool reports_edges() const { return false; }

  protected:
    ~PinPort() = default;
};

/// Registers that several cores share, for the microseconds of a write. A waiter looks 2^20 times
/// and then goes on without it: a panic has stopped the holder, and safe levels must not wait.
class PortLock {
  public:
    void lock() {
        for (std::uint32_t looks = 0; looks < kMostLooks; ++looks) {
            if (!taken_.exchange(true, std::memory_order_acquire)) return;
        }
    }
    void unlock() { taken_.store(false, std::memory_order_release); }

  private:
    static constexpr std::uint32_t kMostLooks = 1u << 20;

    std::atomic<bool> taken_{false};
};

class PortGuard {
  public:
    explicit PortGuard(PortLock& lock) : lock_(lock) { lock_.lock(); }
    ~PortGuard() { lock_.unlock(); }
    PortGuard(const PortGuard&) = delete;
    PortGuard& operator=(const PortGuard&) = delete;

  private:
    PortLock& lock_;
};

}  // namespace qduino::board::metal
