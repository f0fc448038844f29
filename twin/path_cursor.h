// The place on the asked path that the steps so far have led to, and what the comparison of built
// with asked has come to there.
//
// A follower looks ahead on a PathPlace of its own; the cursor goes where the follower commits it.
// Wherever it is, the distance |built − asked(s)| of every motor is noted.
//
// A wrong step must not drag the cursor along. A step is unexplained if only leaving another axis
// more than kAstraySteps behind could explain it. It is counted, noted with its deviation, and s
// stays. Each further unexplained step widens that limit by one, so that after lost steps the
// comparison finds its place again (and reports them).
//
// Where a delta's carriage turns back it nearly stands, and .01 of a step is a long way: its
// crossing is known to a fifth of a millimetre only. So there a step takes the cursor to the first
// place that explains it but for a tie, never past it. The other carriages take it on.
//
// Invariants: s never goes back, except by stand_at(); memory is bounded by the look-ahead
// (kLookAhead items) and one read buffer.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>

#include "base/time.h"
#include "twin/asked_pieces.h"
#include "twin/findings.h"

namespace qduino::twin {

/// The motors as the pins have shown them.
struct SeenMotors {
    /// Nothing moved for this long: a rest. The machine rests longer on both ends of an excursion.
    static constexpr Nanoseconds kRest{40'000'000};

    Counts position{};                        ///< as the twin counts
    std::array<double, kAxisCount> origin{};  ///< that count at coordinate 0
    std::array<bool, kSlideCount> pressed{};  ///< switches
    Instant now{};

    [[nodiscard]] double steps(std::size_t motor) const {
        return static_cast<double>(position[motor]) - origin[motor];
    }
    [[nodiscard]] MotorPoint place() const { return {steps(0), steps(1), steps(2), steps(kExtruder)}; }
    [[nodiscard]] bool rest_until(Instant at) const { return at - now >= kRest; }
};

/// The state of the comparison; coming back from an excursion restores it.
struct Comparison {
    double share = 0;            ///< of the first piece: the cursor
    MotorPoint at{};             ///< asked there
    MotorPoint built{};          ///< whole steps relative to the origin
    std::int64_t net_steps = 0;  ///< of the extruder
    std::uint64_t pushed_steps = 0;
    std::uint64_t unexplained_run = 0;
    MotorPoint worst{};         ///< from straight pieces
    MotorPoint worst_curved{};  ///< from curves
    Findings findings{};

    [[nodiscard]] double off(std::size_t motor) const { return std::abs(built[motor] - at[motor]); }
    void count_unexplained(std::size_t motor) {
        ++unexplained_run;
        ++findings.axes[motor].unexplained;
    }
};

/// A place on the path: piece and share of it. `at` is asked(s).
struct PathPlace {
    std::size_t piece = 0;
    double share = 0;
    MotorPoint at{};
    MotorPoint worst{};   ///< largest deviations met on the way here
    bool curved = false;  ///< the way here touched a curve
};

/// A step that is to be explained.
struct MotorStep {
    std::size_t axis = 0;
    double direction = 1;
    double boundary = 0;
    double limit_steps = 0;  ///< how far another axis may be left behind
};

class PathCursor {
  public:
    static constexpr double kAstraySteps = 2.0;
    static constexpr std::size_t kLookAhead = 4096;
    static constexpr double kTieSteps = AskedPieces::kTieSteps;
    /// On top of the steps above: a firmware's chord may be so far from the true curve.
    static constexpr double kChordMm = 0.006;
    /// With a shaper, in reaches: since the cursor came where it is, the slides went at most two
    /// reaches, and the plan was at most one from them; so 3.
    static constexpr double kPassBalls = 3;
    /// … its distance is looked for among so many pieces on each side.
    static constexpr std::size_t kAround = 24;
    /// After this many unexplained steps in a row, or this far off with E alone, the head is away:
    /// the inspector stops looking for its place on the path.
    static constexpr std::uint64_t kAwaySteps = 64;

    /// `source` must outlive the cursor.
    PathCursor(const Machine& machine, ByteSource& source, const InspectionStart& start);

    [[nodiscard]] AskedPieces& pieces() { return pieces_; }
    [[nodiscard]] const AskedPieces& pieces() const { return pieces_; }
    [[nodiscard]] const Allowance& allowance() const { return pieces_.allowance(); }
    [[nodiscard]] Comparison& so_far() { return so_far_; }
    [[nodiscard]] const Comparison& so_far() const { return so_far_; }
    [[nodiscard]] double steps_per_mm(std::size_t motor) const { return pieces_.space().steps_per_mm(motor); }
    /// Where it is, to look on from.
    [[nodiscard]] PathPlace place() const {
        return {0, so_far_.share, so_far_.at, {}, pieces_.front().curved};
    }
    /// The piece that `so_far().at` is on: of a shaped motion it may be beyond the cursor.
    [[nodiscard]] const AskedPiece& shown() const { return pieces_[shown_]; }
    void show(std::size_t piece, double share) {
        shown_ = piece;
        so_far_.at = pieces_[piece].at(share);
    }
    /// A step has been built: what it asks of the path.
    [[nodiscard]] MotorStep step_of(std::size_t axis, int direction) const {
        const double way = direction;
        const double limit =
            axis == kExtruder ? 0 : kAstraySteps + static_cast<double>(so_far_.unexplained_run);
        return {axis, way, so_far_.built[axis] - 0.5 * way, limit};
    }
    /// A step takes the cursor so far before its boundary.
    [[nodiscard]] double early_steps() const { return early_steps_; }

    /// Moves `place` along its piece to the first place that explains the step; false when none
    /// does.
    [[nodiscard]] bool creep(PathPlace& place, const MotorStep& step) const;
    /// True when going to `place` leaves no other slide further behind (or ahead) than the limit
    /// allows.
    [[nodiscard]] bool others_near(const PathPlace& place, const MotorStep& step) const;
    /// Moves `place` to the end of its piece. False when that leaves a slide too far from its
    /// position.
    [[nodiscard]] bool pass_end(PathPlace& place, const MotorStep& step) const;
    /// The share of `here`, not less than `from`, nearest to where the slides stand, in mm.
    [[nodiscard]] double nearest_share(const AskedPiece& here, double from) const;
    /// Behind filters: how far a slide's motor may be from where the plan is.
    [[nodiscard]] double ball_steps(std::size_t axis) const;
    /// How far `at` is from where the slides stand, in such distances: the largest of the motors'.
    [[nodiscard]] double beside(const MotorPoint& at) const;

    /// The cursor goes to `place`, and drops the pieces before it.
    void go_to(const PathPlace& place);
    /// … and notes how far the motors are from there, and were on the way.
    void commit(const PathPlace& place);
    /// … on the piece that it is on.
    void advance(const PathPlace& place) {
        so_far_.share = place.share;
        so_far_.at = place.at;
        note_all(false);
    }
    /// … and then to the end of that piece: a homing, or a probing, begins.
    void wait_at_end(const PathPlace& place) {
        commit(place);
        so_far_.at = pieces_.front().to;
        so_far_.share = 1;
        passed_.clear();
    }
    void note(std::size_t axis, double deviation_steps, bool curved) {
        if (deviation_steps > (curved ? so_far_.worst_curved : so_far_.worst)[axis])
            note_worst(axis, deviation_steps, curved);
    }
    /// On a curve, what the slides are beside it is noted where they step (curve_follower.h).
    void note_all(bool curved) {
        for (std::size_t axis = curved ? kExtruder : 0; axis < kAxisCount; ++axis)
            note(axis, so_far_.off(axis), curved);
    }
    /// Passes the pieces that ask for no further step. True when that leads to the end of the path.
    [[nodiscard]] bool pass_rest();

    /// Back to a place where the comparison stood like `then`, with `pieces` ahead, when piece
    /// `next` was the next to be read.
    void stand_at(const Comparison& then, const std::deque<AskedPiece>& pieces, std::uint64_t next);
    /// As it stood at `then`, but for what has been read of the file since.
    void take_back(const PathCursor& then);
    /// Filament is asked anew from a place on that a person's line has changed. Where the cursor
    /// has been there already, E was not wrong since: what was noted of it is forgotten.
    void stretch(const AskedPath::Stretch& by);

  private:
    /// The largest deviation of E until the cursor came to a line.
    struct WorstExtruder {
        std::uint64_t line = 0;
        double steps = 0;
    };

    void note_worst(std::size_t axis, double deviation_steps, bool curved);
    [[nodiscard]] MotorPoint off_nearest_piece();
    [[nodiscard]] double worst_extruder_before(std::uint64_t line) const;
    void note_worst_extruder();

    AskedPieces pieces_;  // the first holds the cursor
    Comparison so_far_;
    double early_steps_;
    std::size_t shown_ = 0;
    std::deque<AskedPiece> passed_;             // the last kAround, of a shaped motion
    std::deque<WorstExtruder> worst_extruder_;  // of the last lines
};

// Nearly every step ends in these two.

inline bool PathCursor::creep(PathPlace& place, const MotorStep& step) const {
    const AskedPiece& here = pieces_[place.piece];
    const double beyond = step.direction * (here.to[step.axis] - step.boundary);
    const double length = here.to[step.axis] - here.from[step.axis];
    if (beyond < -kTieSteps || step.direction * length <= 0) return false;
    const double first = step.boundary - step.direction * early_steps_;
    place.share = std::clamp((first - here.from[step.axis]) / length, place.share, 1.0);
    place.at = here.at(place.share);
    return true;
}

inline bool PathCursor::others_near(const PathPlace& place, const MotorStep& step) const {
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
        const double deviation = std::abs(so_far_.built[axis] - place.at[axis]);
        const double limit = step.limit_steps + allowance().slack_steps(axis);
        if (deviation <= limit || axis == step.axis) continue;
        if (deviation > limit + std::max(so_far_.off(axis), 0.5)) return false;
    }
    return true;
}

}  // namespace qduino::twin
