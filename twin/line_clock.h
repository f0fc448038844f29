// How long each line of the file took, by what was moved: the witness of an estimate.
//
// The time from one microstep to the next belongs to the line that the second one is on. A rest of
// kRest or more (the nozzle heats up, the job is paused) belongs to no line.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "base/time.h"

namespace qduino::twin {

class LineClock {
  public:
    static constexpr Nanoseconds kRest{1'000'000'000};
    /// Lines beyond are counted with this one.
    static constexpr std::uint64_t kLineLimit = 20'000'000;

    explicit LineClock(Instant now) : at_(now) {}

    /// A microstep of `line`.
    void step(Instant now, std::uint64_t line) {
        const Nanoseconds passed = now - at_;
        at_ = now;
        if (passed >= kRest) {
            rested_s_ += to_seconds(passed);
            return;
        }
        const auto index = static_cast<std::size_t>(std::min(line, kLineLimit));
        if (index >= seconds_.size()) seconds_.resize(index + index / 4 + 1);
        seconds_[index] += static_cast<float>(to_seconds(passed));
    }

    /// Indexed by line. It has more entries than the file has lines.
    [[nodiscard]] const std::vector<float>& seconds() const { return seconds_; }
    [[nodiscard]] double rested_s() const { return rested_s_; }

  private:
    Instant at_;
    std::vector<float> seconds_;
    double rested_s_ = 0;
};

}  // namespace qduino::twin
