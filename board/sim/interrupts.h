// The interrupt sources of a simulated computer: when each fires next, and on which core.
//
// Every source has its own random stream, seeded by the computer's seed and its place in the list:
// routing or silencing one does not change when another fires.
#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <vector>

#include "base/time.h"
#include "board/sim/config.h"
#include "board/types.h"

namespace qduino::board::sim {

class Interrupts {
  public:
    struct Fired {
        int core = 0;
        DeviceClass device = DeviceClass::all;  ///< all: the scheduling tick
        Nanoseconds top_half{};
        Nanoseconds bottom_half{};
    };

    /// Contract: rates > 0, cores in range.
    explicit Interrupts(const SimConfig& config);

    /// The earliest instant at which a source fires.
    [[nodiscard]] Instant next() const { return next_; }
    /// Takes one source that is due at `now`, in order of the list. False when none is.
    [[nodiscard]] bool take_due(Instant now, Fired& fired);

    /// False, and nothing changed, when no core would take the class any more.
    [[nodiscard]] bool route(DeviceClass device, int core, bool allowed);
    /// Bottom halves of `device` are the work of I/O VCPU `io` from now on; kNoVcpu: of nobody.
    void serve(DeviceClass device, VcpuId io);
    [[nodiscard]] VcpuId server_of(DeviceClass device) const {
        return served_by_[static_cast<std::size_t>(device)];
    }
    void set_tick(int core, bool enabled, Instant now);
    [[nodiscard]] bool ticks(int core) const;
    /// Mean rate at which `core` is interrupted, faults aside.
    [[nodiscard]] double rate_hz(int core) const;
    /// The sources that interrupt `core` now, faults aside.
    [[nodiscard]] std::vector<InterruptSource> on_core(int core) const;

  private:
    struct Source {
        InterruptSource config;
        bool tick = false;
        bool stuck = false;
        Instant origin = kEpoch;  // of the periodic grid
        std::uint64_t count = 0;  // on that grid
        Instant next = kForever;
        std::mt19937_64 random;
    };
    void schedule_next(Source& source);
    void refresh_next();
    [[nodiscard]] int core_for(const InterruptSource& source) const;

    std::vector<Source> sources_;
    std::array<std::uint64_t, kDeviceClassCount> allowed_{};  // one bit for each core
    std::array<VcpuId, kDeviceClassCount> served_by_{};
    Instant next_ = kForever;
};

}  // namespace qduino::board::sim
