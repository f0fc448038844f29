// The simulated cores, and the VCPUs that were started on them.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "base/result.h"
#include "board/sim/sim_core.h"

namespace qduino::board::sim {

class SimCpus {
  public:
    SimCpus(EventLoop& loop, const SimConfig& config);

    /// Makes a VCPU of each spec, whose fiber runs `entry` on it. Error: a spec is malformed, or
    /// its core is another loop's.
    [[nodiscard]] Result<void> start(std::span<const VcpuSpec> specs, Instant now, void (*entry)(void* vcpu));

    [[nodiscard]] int core_count() const { return static_cast<int>(cores_.size()); }
    [[nodiscard]] SimCore& core(int number) { return *cores_[static_cast<std::size_t>(number)]; }
    [[nodiscard]] const SimCore& core(int number) const { return *cores_[static_cast<std::size_t>(number)]; }
    /// Null: there is none of this number.
    [[nodiscard]] Vcpu* vcpu(VcpuId id) const { return id < kVcpuLimit ? vcpus_[id].get() : nullptr; }
    /// Calls `visit` with each VCPU, in order of id.
    template <typename Visit>
    void each(Visit visit) const {
        for (const auto& vcpu : vcpus_) {
            if (vcpu) visit(*vcpu);
        }
    }

    /// The next instant at which a core is to settle.
    [[nodiscard]] Instant next_due() const;
    /// Settles the cores that are due at `now`.
    void settle(Instant now);
    /// The lowest core whose VCPU's code may go on; null: none.
    [[nodiscard]] SimCore* ready_core() const;
    /// When anything happens on a core other than `core`; `now` when another one's code may go on.
    [[nodiscard]] Instant others_due(const SimCore& core, Instant now) const;

    void note_finished() { --unfinished_; }
    [[nodiscard]] bool all_finished() const { return unfinished_ == 0; }

  private:
    EventLoop& loop_;
    const SimConfig& config_;
    std::vector<std::unique_ptr<SimCore>> cores_;
    std::array<std::unique_ptr<Vcpu>, kVcpuLimit> vcpus_;
    std::size_t unfinished_ = 0;  // main VCPUs
};

}  // namespace qduino::board::sim
