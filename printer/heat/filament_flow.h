// How much filament is melted per second, from where the extruder stands.
//
// A retraction draws back what is molten already, and the recovery brings it back: neither takes
// heat. So only filament beyond the furthest place counts. Steps come in bursts beside samples of 8
// ms, so the flow goes through a low pass. Pure.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "printer/machine_config.h"

namespace qduino::printer::heat {

class FilamentFlow {
  public:
    static constexpr double kFilter_s = 0.3;

    explicit FilamentFlow(const MachineConfig& config)
        : step_mm3_(filament_area_mm2(config) / config.axes[Axis::e].steps_per_mm) {}

    /// `steps`: where E stands, `dt_s` after the last call. Returns mm³/s.
    double sample(std::int64_t steps, double dt_s) {
        const std::int64_t fresh = std::max<std::int64_t>(steps - furthest_, 0);
        furthest_ = std::max(furthest_, steps);
        const double flow = static_cast<double>(fresh) * step_mm3_ / dt_s;
        flow_mm3_s_ += (1 - std::exp(-dt_s / kFilter_s)) * (flow - flow_mm3_s_);
        return flow_mm3_s_;
    }

  private:
    double step_mm3_;
    std::int64_t furthest_ = 0;
    double flow_mm3_s_ = 0;
};

}  // namespace qduino::printer::heat
