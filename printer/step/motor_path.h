// The position of one motor as a function of time, window by window: the seam between a kinematics
// and the solver. Whatever moves the tool, a motor is a polynomial of the time here.
//
//   axis paths (axis_path.h)      x(t) y(t) z(t) e(t), each with windows of its own
//        │ the axes that move this motor
//        ▼
//   linear machine                Σ row[axis] · axis(t): windows as the axes have them
//   any other                     motors_from_tool(x(t), y(t), z(t)) at six instants of the window,
//                                 and the polynomial of degree 5 through them
//        │
//        ▼
//   window: steps(t) from start_s() to end_s()            ─► crossing_search.h
//
// Which axes move a motor, and in which proportion, is found out by asking the kinematics once.
//
// Interpolation. The instants are the zeros of the Chebyshev polynomial T6, which keeps the error
// smallest: |f⁽⁶⁾|·(w/2)⁶/(2⁵·6!) over a window of w seconds. The error is looked at in two places
// between them, and the window halved until it is below kInterpolation_mm.
//
// Pure; no heap.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "printer/motion/settings.h"
#include "printer/step/axis_path.h"

namespace qduino::printer::step {

/// Half of the smoothing time, where the filament's way is smoothed.
[[nodiscard]] inline double half_smoothing_s(const motion::MotionFilters& filters) {
    return 0.5 * filters.smooth_time.value();
}

class MotorPath {
  public:
    static constexpr double kInterpolation_mm = 1e-9;
    static constexpr double kWindowMax_s = 0.032;  ///< of interpolation

    /// `motor`: its number is that of the axis whose pins and steps per mm it has.
    void configure(const motion::MotionSettings& settings, const motion::MotionFilters& filters,
                   std::size_t motor);
    /// Starts at `at_s`, from when on all filters stand on `track`.
    void begin(const MotionTrack& track, double at_s);

    /// Goes on to the next window. False: the track is not known so far.
    [[nodiscard]] bool next(const MotionTrack& track);

    [[nodiscard]] double start_s() const { return start_s_; }
    [[nodiscard]] double end_s() const { return end_s_; }
    /// Microsteps, as a polynomial in the time since start_s(); it holds until end_s().
    [[nodiscard]] const Polynomial& steps() const { return steps_; }
    /// The first piece of the track that this still needs.
    [[nodiscard]] std::uint64_t oldest() const;
    /// How far its filters look into the future, and back.
    [[nodiscard]] double future_s() const;
    [[nodiscard]] double past_s() const;

  private:
    [[nodiscard]] bool moved_by(std::size_t axis) const { return (axes_ >> axis & 1u) != 0; }
    void combine();
    void interpolate();
    [[nodiscard]] double motor_at(double after_s) const;

    Kinematics kinematics_;
    std::size_t motor_ = 0;
    double steps_per_mm_ = 1;
    unsigned axes_ = 0;         // bit per axis that moves this motor
    motion::AxisVector row_{};  // of a linear machine: motor mm per axis mm
    std::array<AxisPath, kAxisCount> paths_;
    double start_s_ = 0;
    double end_s_ = 0;
    Polynomial steps_;
};

}  // namespace qduino::printer::step
