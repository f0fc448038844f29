// Is filament really pushed ahead of the motion, by as much as pressure advance asks for?
//
// While the filament flows evenly at v, it must be ahead of the asked path by advance · v. So
// stretches of even flow are looked at, longer than the advance is smoothed over:
//
//   asked at the cursor    a1 ............ a2     v = (a2 − a1) / (t2 − t1), as in both halves
//   built                 ─●──●──●──●──●──●─      lead = mean of built − asked
//
// All stretches together give the gain, the factor of the asked lead that was built: least squares
// through 0. 1: as asked; 0: no advance. A single stretch says little, because E stands on whole
// microsteps, and its zero is known to half of one.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "base/time.h"

namespace qduino::twin {

class AdvanceWatch {
  public:
    /// So many stretches must have been seen before the gain means anything.
    static constexpr std::uint64_t kStretchesMin = 12;
    static constexpr double kSmoothings = 2.5;  ///< the length of a stretch
    static constexpr double kShortest_s = 0.06;
    static constexpr double kEven = 0.05;  ///< how much the halves' speeds may differ

    /// The filament made a step forward at `at`; in mm. `advance_s`, `smooth_s`: asked there.
    void on_push(Instant at, double asked_mm, double built_mm, double advance_s, double smooth_s) {
        if (advance_s <= 0) return interrupt();
        if (count_ == kSamples || (count_ > 0 && advance_s != advance_s_)) interrupt();
        advance_s_ = advance_s;
        samples_[count_++] = {to_seconds(at - kEpoch), asked_mm, built_mm};
        const double length_s = std::fmax(kSmoothings * smooth_s, kShortest_s);
        if (samples_[count_ - 1].at_s - samples_[0].at_s < length_s) return;
        if (count_ >= kFewest) take_stretch();
        interrupt();
    }
    /// The flow is no longer one of a moving head that pushes.
    void interrupt() { count_ = 0; }

    [[nodiscard]] std::uint64_t stretches() const { return stretches_; }
    [[nodiscard]] double gain() const { return weight_ > 0 ? product_ / weight_ : 1; }

  private:
    static constexpr std::size_t kSamples = 1024;
    static constexpr std::size_t kFewest = 5;
    struct Sample {
        double at_s = 0, asked_mm = 0, built_mm = 0;
    };

    [[nodiscard]] double speed(std::size_t from, std::size_t to) const {
        return (samples_[to].asked_mm - samples_[from].asked_mm) / (samples_[to].at_s - samples_[from].at_s);
    }
    void take_stretch() {
        const std::size_t last = count_ - 1;
        const double first_half = speed(0, last / 2);
        const double second_half = speed(last / 2, last);
        const double v = speed(0, last);
        if (!(v > 0) || std::abs(first_half - second_half) > kEven * v) return;
        double lead = 0;
        for (std::size_t i = 0; i < count_; ++i) lead += samples_[i].built_mm - samples_[i].asked_mm;
        lead /= static_cast<double>(count_);
        const double wanted = advance_s_ * v;
        product_ += lead * wanted;
        weight_ += wanted * wanted;
        ++stretches_;
    }

    std::array<Sample, kSamples> samples_{};
    std::size_t count_ = 0;
    double advance_s_ = 0;
    double product_ = 0;
    double weight_ = 0;
    std::uint64_t stretches_ = 0;
};

}  // namespace qduino::twin
