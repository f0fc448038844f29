// The devices that interrupt: on which core each one's top half runs, and on which I/O VCPU its
// bottom half does.
//
//   line ─► I/O APIC ─► core ─► top half: quiet() ─► work for the I/O VCPU ─► bottom half: serve()
//              ▲                                       none: serve() at once, above every loop
//   noInterrupts(device, core) rewrites the entry
//
// A device that was quieted raises no interrupt until it was served. So a storm of interrupts costs
// a core one top half for each time that the I/O VCPU's budget lets it serve.
#pragma once

#include <array>
#include <cstdint>

#include "base/fixed_vector.h"
#include "base/result.h"
#include "base/time.h"
#include "board/metal/machine/io_apic.h"
#include "board/types.h"

namespace qduino::board::metal {

class Device {
  public:
    /// The top half, on the core that was interrupted: no interrupt from now on. It is short.
    virtual void quiet() = 0;
    /// The bottom half: does all that there is to do, and lets the device interrupt again. By one
    /// caller at a time.
    virtual void serve() = 0;

  protected:
    ~Device() = default;
};

class DeviceInterrupts {
  public:
    /// Contract: not more than 16. `io_apic` and `device` outlive it. The first core gets it.
    void add(IoApic& io_apic, DeviceClass kind, std::uint8_t line, Device& device);
    /// As board.h has them. Setup-time.
    void serve_on(DeviceClass kind, VcpuId io);
    Result<void> route(DeviceClass kind, int core, bool allowed);
    /// The I/O VCPUs have their cores: each device goes to that of its own, where that takes it.
    void route_all();

    /// The top half of device `index`, which interrupted this core at `now`.
    void serve(std::size_t index, Instant now);
    /// The I/O VCPUs have ended: from now on top halves serve, and here what was left to serve.
    void serve_all();
    /// Of the devices whose interrupts come to `core`.
    [[nodiscard]] int count_on(int core) const;

  private:
    struct Entry {
        IoApic* io_apic = nullptr;
        Device* device = nullptr;
        DeviceClass kind = DeviceClass::all;
        std::uint8_t line = 0;
        VcpuId io = kNoVcpu;
        int core = 0;
    };
    void route(Entry& entry);

    FixedVector<Entry, 16> entries_;
    std::array<std::uint64_t, kDeviceClassCount> forbidden_{};  // one bit for each core
};

inline constinit DeviceInterrupts device_interrupts;

}  // namespace qduino::board::metal
