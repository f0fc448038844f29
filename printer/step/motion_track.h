// The planned motion as a queue of pieces, on a clock of seconds: what filters look back and ahead
// on.
//
// A piece is a stretch of time in which the tool goes straight and its distance along the way is
// one polynomial: a phase of a segment (accelerating, cruising, braking), or a rest. Pieces join in
// time and in place:
//
//      | rest |  accelerate | cruise |  brake  | accelerate …| rest |
//      ^ first()            ^ piece(n)                        end_s()
//
// Pieces are numbered for ever; a reader holds numbers. What all readers have passed is dropped.
//
// A curve of very short moves could fill any queue. From half of its room on, segments shorter than
// kShort_s are joined into pieces of a constant speed, kJoined_s long at least. Then kCapacity / 2
// pieces are more than a second, and no filter reaches that far. The joined way leaves the planned
// one by a·t²/8: a quarter of a micrometre at 2000 mm/s².
//
// Invariant: at least one piece is there from begin() on, and starts increase.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "base/contract.h"
#include "printer/motion/segment.h"

namespace qduino::printer::step {

struct MotionPiece {
    double start_s = 0;
    motion::AxisVector at_mm{};  ///< where it begins
    motion::AxisVector way{};    ///< of each axis for a mm of path
    /// The distance after t: path[0]·t + path[1]·t² + path[2]·t³.
    std::array<double, 3> path{};
    double advance_s = 0;  ///< pressure advance in force

    /// Coefficients of the position of `axis` in the time since `start_s` + `after_s`.
    [[nodiscard]] std::array<double, 4> position(std::size_t axis, double after_s) const {
        const double t = after_s;
        const double distance = t * (path[0] + t * (path[1] + t * path[2]));
        const double speed = path[0] + t * (2 * path[1] + t * 3 * path[2]);
        const double w = way[axis];
        return {at_mm[axis] + w * distance, w * speed, w * (path[1] + 3 * t * path[2]), w * path[2]};
    }
};

class MotionTrack {
  public:
    static constexpr std::size_t kCapacity = 8192;
    static constexpr double kShort_s = 1e-3;
    static constexpr double kJoined_s = 0.5e-3;
    /// The most that one segment takes: seven phases, and a joined piece before it.
    static constexpr std::size_t kPiecesPerSegment = 8;

    /// Forgets everything: the tool rests at `at_mm` from `start_s` to `end_s`.
    void begin(const motion::AxisVector& at_mm, double start_s, double end_s) {
        first_ = next_ = 0;
        joined_ = Joined{};
        end_s_ = pushed_s_ = start_s;
        end_mm_ = pushed_mm_ = at_mm;
        rest(end_s - start_s);
    }
    /// The next segment of the planner. Contract: it begins where the last one ended; has_room().
    void append(const motion::Segment& segment, double start_s);
    /// Stands still for `duration_s` more.
    void rest(double duration_s);

    [[nodiscard]] bool has_room() const { return size() + kPiecesPerSegment < kCapacity; }
    [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>(next_ - first_); }
    /// Up to here the pieces go.
    [[nodiscard]] double end_s() const { return pushed_s_; }
    [[nodiscard]] const motion::AxisVector& end_mm() const { return end_mm_; }

    [[nodiscard]] std::uint64_t first() const { return first_; }
    [[nodiscard]] bool has(std::uint64_t number) const { return number < next_; }
    [[nodiscard]] const MotionPiece& piece(std::uint64_t number) const { return pieces_[number % kCapacity]; }
    /// Where piece `number` begins: the end of all, for the one that is not there yet.
    [[nodiscard]] double start_of(std::uint64_t number) const {
        return number < next_ ? piece(number).start_s : pushed_s_;
    }
    /// Nobody looks at pieces before `number` any more.
    void drop_before(std::uint64_t number) { first_ = number; }

  private:
    /// Short segments on their way to becoming one piece.
    struct Joined {
        double start_s = 0;
        double advance_s = 0;
        bool active = false;
    };

    void push(const MotionPiece& piece) {
        QDUINO_EXPECT(size() < kCapacity);
        pieces_[next_++ % kCapacity] = piece;
    }
    void push_phase(MotionPiece& piece, double duration_s, const std::array<double, 3>& path);
    void push_ramp(const motion::Trapezoid& shape, MotionPiece& piece, double from_mm_s, double to_mm_s,
                   double duration_s);
    void end_joined();

    std::uint64_t first_ = 0;
    std::uint64_t next_ = 0;
    double end_s_ = 0;  // of all segments
    motion::AxisVector end_mm_{};
    double pushed_s_ = 0;  // of the pieces: behind while segments are being joined
    motion::AxisVector pushed_mm_{};
    Joined joined_;
    std::array<MotionPiece, kCapacity> pieces_{};
};

}  // namespace qduino::printer::step
