// The position of one axis behind its filter, as a function of time: one polynomial for each
// window.
//
// Planned motion is a polynomial of the time within each piece (motion_track.h). Two filters keep
// it one between certain instants, the edges:
//
//   shaper     the sum of a few shifted copies (motion/shaper.h). Edges: the ends of the pieces,
//              shifted by each impulse. The degree stays.
//   smoothing  the filament's place plus advance times its speed, p(t), averaged around t with the
//              weight (h − |u|)/h² at t + u (Klipper's documentation, "Kinematics"). This
//              is a second difference of the second integral P of p,
//
//                 (P(t + h) − 2·P(t) + P(t − h)) / h²
//
//              so its edges are the ends of the pieces, shifted by −h, 0, h. The degree grows by 2.
//
//   pieces  ----|--------|---------------|-----> time
//   impulse 1 ----|--------|---------------|        each copy has its own edges; between two edges
//   impulse 2 --|--------|---------------|          of any of them, the sum is one polynomial:
//   windows -|--|-|------|-|-------------|-|->      a window
//
// Smoothing in windows. P itself grows without bound, and its second difference would drown in
// rounding. So the window's polynomial is written around the piece at t, and each end b of a piece
// within ±h adds what changes there. With J_k the jump of p's k-th coefficient at b,
//
//      p_t(t) + h²/12·p_t''(t) + Σ J_k·k!/(k+2)!·(t + h − b)^(k+2)/h²      b ahead of t
//                              − Σ J_k·k!/(k+2)!·(−1)^k·(b − t + h)^(k+2)/h²   b behind
//
// and where the next window differs from this one by the edge of one b, its polynomial does by one
// such term: 1, −2 and 1 times J_k·k!/(k+2)!·(t − edge)^(k+2)/h². Many ends within ±h (curves of
// tiny moves) take this short way, and the sum is made anew every kSumEvery windows, so that
// rounding does not add up.
//
// Pure; no heap. A reader of the track: it must not drop pieces from oldest() on.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "printer/motion/shaper.h"
#include "printer/step/motion_track.h"
#include "printer/step/polynomial.h"

namespace qduino::printer::step {

class AxisPath {
  public:
    /// `half_smoothing_s` above 0: smoothing with pressure advance, in place of a shaper.
    void set_filter(const motion::Impulses& impulses, double half_smoothing_s);
    /// Starts at `at_s`, from when on the filter stands on `track`. The first window is next().
    void begin(const MotionTrack& track, std::size_t axis, double at_s);

    /// Goes on to the next window. False, and nothing changed: the track is not known so far.
    [[nodiscard]] bool next(const MotionTrack& track);

    [[nodiscard]] double start_s() const { return start_s_; }
    [[nodiscard]] double end_s() const { return end_s_; }
    /// mm, as a polynomial in the time since start_s(); it holds until end_s().
    [[nodiscard]] const Polynomial& position() const { return position_; }
    /// The first piece that this still needs.
    [[nodiscard]] std::uint64_t oldest() const { return cursors_[copies_ - 1]; }
    [[nodiscard]] double future_s() const { return ahead_s_[0]; }
    [[nodiscard]] double past_s() const { return -ahead_s_[copies_ - 1]; }

  private:
    /// With so few ends of pieces within reach the sum is made anew at once.
    static constexpr std::uint64_t kFewEnds = 8;
    static constexpr int kSumEvery = 64;

    [[nodiscard]] double edge(const MotionTrack& track, std::size_t copy) const {
        return track.start_of(cursors_[copy] + 1) - ahead_s_[copy];
    }
    void find_end(const MotionTrack& track);
    void add_copies(const MotionTrack& track);
    void cross(const MotionTrack& track, std::size_t copy);
    void smooth_anew(const MotionTrack& track);
    [[nodiscard]] std::array<double, 4> pressed(const MotionPiece& piece, double after_s) const;
    [[nodiscard]] Polynomial change_at(const MotionTrack& track, std::uint64_t number) const;

    std::size_t axis_ = 0;
    std::size_t copies_ = 1;  // impulses, or the three places of the second difference
    std::array<double, motion::Impulses::kMax> ahead_s_{};  // falling
    std::array<double, motion::Impulses::kMax> share_{1};
    double half_s_ = 0;                                            // h; 0: no smoothing
    std::array<std::uint64_t, motion::Impulses::kMax> cursors_{};  // the piece at t + ahead
    double start_s_ = 0;
    double end_s_ = 0;
    int since_sum_ = 0;
    Polynomial position_;
};

}  // namespace qduino::printer::step
