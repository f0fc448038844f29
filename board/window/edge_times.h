// When the last edges of one kind came at a pin: the newest are kept, each under its number.
//
// One writer, any reader; may lie in shared memory (zeroes: none came). The writer notes an edge's
// instant before it counts the edge, so who has the count finds the instant.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "base/time.h"

namespace qduino::board {

class EdgeTimes {
  public:
    static constexpr std::uint32_t kKept = 16;

    /// Edge `number`, counted from 1 and wrapping, came at `at`. Before it is counted.
    void note(std::uint32_t number, Instant at) {
        times_ns_[number % kKept].store(to_ns(at), std::memory_order_relaxed);
    }
    /// When edge `number` came, where `newest` have come as of now; kForever: that is forgotten.
    [[nodiscard]] Instant at(std::uint32_t number, std::uint32_t newest) const {
        // The place of the oldest may be the next one's already.
        if (newest - number >= kKept - 1) return kForever;
        return instant_from_ns(times_ns_[number % kKept].load(std::memory_order_relaxed));
    }

  private:
    std::array<std::atomic<std::int64_t>, kKept> times_ns_{};
};

}  // namespace qduino::board
