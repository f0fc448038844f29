// The highest rate of steps of each axis, over kSteps steps: one step alone says more about when it
// was sent than about the speed.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

#include "base/time.h"
#include "twin/machine.h"

namespace qduino::twin {

class StepRates {
  public:
    static constexpr std::uint64_t kSteps = 16;

    /// Axis `axis` made a microstep.
    void step(Instant now, std::size_t axis) {
        Track& track = tracks_[axis];
        std::int64_t& oldest = track.times_ns[track.count % kSteps];
        if (track.count >= kSteps) track.shortest_ns = std::min(track.shortest_ns, to_ns(now) - oldest);
        oldest = to_ns(now);
        ++track.count;
    }

    /// Steps a second; 0 for an axis with no more than kSteps steps.
    [[nodiscard]] double peak(std::size_t axis) const {
        const Track& track = tracks_[axis];
        if (track.count <= kSteps) return 0;
        return static_cast<double>(kSteps) * 1e9 /
               static_cast<double>(std::max<std::int64_t>(track.shortest_ns, 1));
    }

  private:
    struct Track {
        std::array<std::int64_t, kSteps> times_ns{};
        std::uint64_t count = 0;
        std::int64_t shortest_ns = std::numeric_limits<std::int64_t>::max();
    };
    std::array<Track, kAxisCount> tracks_{};
};

}  // namespace qduino::twin
