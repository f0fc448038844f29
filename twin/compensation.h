// Input shaping and pressure advance, as the twin understands them: what a file asks for, and how
// far a motion that is filtered so may be from the asked path.
//
// A shaper replaces a position x(t) by a weighted mean of positions around t. Only that is used
// here:
//
//   at a constant speed        nothing changes: the weights are centred
//   at an acceleration a       x is off by a/2 · M2, M2 the weights' second moment
//   a jump of the speed by v   x is off by v · M1, M1 the moment of the weights on one side
//
// Both shrink to nothing at rest. The built place is then no further from the asked path than both
// axes are off together. Z has no shaper. It may begin while X and Y still come to rest, or before;
// the place is then no further from the path than X and Y are.
//
// The weights are worked out a second time, from those of a swing without damping and from how far
// a swing dies down until each impulse, with nothing of the printer's.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "twin/line_reader.h"
#include "twin/machine.h"

namespace qduino::twin {

/// What a shaper does to a motion; all 0 without one.
struct ShaperMoments {
    double reach_s = 0;      ///< from its first impulse to its last
    double one_sided_s = 0;  ///< M1
    double second_s2 = 0;    ///< M2
};

[[nodiscard]] ShaperMoments moments_of(const ShaperSpec& shaper);

/// How far a filtered motion may be from the asked path, on top of what an unfiltered one may.
struct Reach {
    std::array<double, kAxisCount> mm{};

    void widen(const Reach& other) {
        for (std::size_t axis = 0; axis < kAxisCount; ++axis) mm[axis] = std::max(mm[axis], other.mm[axis]);
    }
};

/// What holds at a line of the file.
class Compensation {
  public:
    explicit Compensation(const Machine& machine)
        : shapers_{machine.axes[0].shaper, machine.axes[1].shaper},
          advance_s_(machine.advance_s),
          smooth_s_(machine.smooth_s),
          smooths_(machine.advance_s > 0) {}

    /// Whatever `command` says of it.
    void run(const CommandLine& command);
    [[nodiscard]] double advance_s() const { return advance_s_; }
    [[nodiscard]] double smooth_s() const { return smooths_ ? smooth_s_ : 0; }
    [[nodiscard]] Reach reach(const Machine& machine) const;
    /// Counts the commands that set something.
    [[nodiscard]] std::uint64_t changes() const { return changes_; }

  private:
    void shape(const CommandLine& command);
    void shape_by_words(const CommandLine& command);
    void advance(double seconds) {
        ++changes_;
        advance_s_ = seconds;
        smooths_ = smooths_ || seconds > 0;
    }

    std::array<ShaperSpec, 2> shapers_;
    double advance_s_;
    double smooth_s_;
    bool smooths_;
    std::uint64_t changes_ = 0;
};

}  // namespace qduino::twin
