// The devices that interrupt: on which core each one's top half runs, and on which I/O VCPU its
// bottom half does.
//
//   line ─► controller ─┐
//   message ────────────┴► core ─► top half: quiet() ─► work for the I/O VCPU ─► serve()
//              ▲                                         none: serve() at once, above every loop
//   noInterrupts(device, core) rewrites the controller's entry, or the device's
//
// A device that was quieted raises no interrupt until it was served. So a storm of interrupts costs
// a core one top half for each time that the I/O VCPU's budget lets it serve.
//
// A device may be served without an interrupt, too: when a program asks, or at an instant that the
// device has named.
//
// A top half serves by itself when the I/O VCPU's queue is full. It may have interrupted that very
// bottom half, which then does all once more:
//
//   I/O VCPU    serve() ▒▒▒▒▒▒▒       ▒▒▒▒▒ serve() ▒▒▒▒▒
//   top half                   ▒ again!
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "base/fixed_string.h"
#include "base/fixed_vector.h"
#include "base/result.h"
#include "base/time.h"
#include "board/metal/computer/core_interrupts.h"
#include "board/types.h"

namespace qduino::board::metal {

class Device {
  public:
    /// The top half, on the core that was interrupted: no interrupt from now on. It is short.
    virtual void quiet() = 0;
    /// serve(), by one caller at a time: a caller that comes meanwhile leaves it to that one.
    void serve_in_turn();
    /// When it is to be served though nothing interrupts. From any core.
    [[nodiscard]] virtual Instant next_turn() const { return kForever; }

  protected:
    ~Device() = default;

  private:
    /// The bottom half: does all that there is to do, and lets the device interrupt again.
    virtual void serve() = 0;

    std::atomic<std::uint32_t> calls_{0};  // of serve_in_turn(), since it began
};

class DeviceInterrupts {
  public:
    /// Contract: not more than 14, which a GIC can tell apart when they are asked for (ask()).
    /// `source` and `device` outlive it. The first core gets it. A device
    /// that interrupts by itself has no line.
    void add(InterruptSource& source, DeviceClass kind, std::uint8_t line, Device& device);
    /// As board.h has them. Setup-time.
    void serve_on(DeviceClass kind, VcpuId io);
    Result<void> route(DeviceClass kind, int core, bool allowed);
    /// The I/O VCPUs have their cores: each device goes to that of its own, where that takes it.
    void route_all();

    /// The top half of device `index`, which interrupted this core at `now`.
    void serve(std::size_t index, Instant now);
    /// `device` is served soon, as if it had interrupted. From anywhere.
    void ask(const Device& device);
    /// The next turn of a device whose bottom half is on `core`.
    [[nodiscard]] Instant next_turn(int core) const;
    /// The top halves of those whose turn has come.
    void serve_turns(int core, Instant now);
    /// The I/O VCPUs have ended: from now on top halves serve, and here what was left to serve.
    void serve_all();
    /// The number of devices whose interrupts come to `core`.
    [[nodiscard]] int count_on(int core) const;
    /// Which they are, and who serves them: " (nic: io 33, uart: above every loop)".
    [[nodiscard]] FixedString<80> words_on(int core) const;

  private:
    struct Entry {
        InterruptSource* source = nullptr;
        Device* device = nullptr;
        DeviceClass kind = DeviceClass::all;
        std::uint8_t line = 0;
        int core = 0;
    };
    void route(Entry& entry);
    [[nodiscard]] VcpuId io_of(const Entry& entry) const { return io_[static_cast<std::size_t>(entry.kind)]; }
    [[nodiscard]] bool serves_on(const Entry& entry, int core) const;
    [[nodiscard]] bool give(const Entry& entry, Instant now) const;

    FixedVector<Entry, 14> entries_;
    std::array<VcpuId, kDeviceClassCount> io_{};
    std::array<std::uint64_t, kDeviceClassCount> forbidden_{};  // one bit for each core
};

inline constinit DeviceInterrupts device_interrupts;

}  // namespace qduino::board::metal
