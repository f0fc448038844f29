// A person pauses the print; the head leaves the path and comes back. That is recognised from the
// pins:
//
//   built  path ─────●  (rest)  ~~~ steps off the path, rests ~~~  (rest)  ●───── path
//                    P  kRest                                            P: same steps of X Y Z
//
// At every rest on the path the comparison is remembered. Then steps may follow that the path does
// not ask for. If a later rest finds X, Y and Z back at exactly the steps of P, the comparison goes
// on from what was remembered: the steps in between do not count, and E counts on from where it
// left. One step beside P is not P: then all steps are compared, and differ. The number of
// excursions is a finding. judge() compares it with the number that the machine reports, so a
// detour that the machine hides is still a difference.
#pragma once

#include <cstdint>
#include <deque>

#include "twin/path_cursor.h"

namespace qduino::twin {

class Excursions {
  public:
    /// Rests that are remembered.
    static constexpr std::size_t kRests = 4;
    /// So far behind a rest nobody leaves the path: what goes wrong there is the machine's own
    /// error, and is followed.
    static constexpr std::uint64_t kAwayWithinSteps = 2000;
    /// This near to what was asked, the head is on the path; E by its tolerance.
    static constexpr double kCleanSteps = 1.0;
    static constexpr double kCleanExtruderSteps = 5.0;
    /// A rest nearer than this to the place where it left is worth reporting.
    static constexpr std::int64_t kNearSteps = 400;

    /// Both outlive this.
    Excursions(PathCursor& cursor, SeenMotors& motors) : cursor_(cursor), motors_(motors) {}

    /// Nothing has moved for kRest, and no switch is looked for. Is the head back where it left the
    /// path, and is it on the path at all?
    void rest();
    /// A step of `axis` follows a rest.
    void count_step(std::size_t axis) { since_rest_ += axis < 2 ? 1 : 0; }
    void begin_count() { since_rest_ = 0; }
    /// The path explains a step again.
    void goes_on();
    /// True when the step of `axis` that has been compared leads away.
    [[nodiscard]] bool leaves(std::size_t axis) const;
    void leave() { away_ = true; }
    /// The head has left the path: the inspector does not look for its place on it.
    [[nodiscard]] bool away() const { return away_; }
    /// Microsteps that E moved on excursions, all together.
    [[nodiscard]] std::int64_t pushed_away() const { return pushed_away_; }

    /// The step begins where the head rested last, on the path.
    [[nodiscard]] bool begins_at_rest(const MotorStep& step) const;
    /// Forgets all rests but the newest `count`: zero will be elsewhere.
    void forget_but(std::size_t count);

    /// The path has not explained every step since the last rest on it.
    [[nodiscard]] bool differs() const { return !remembered_.empty() && !is_clean_since(remembered_.back()); }
    /// The job is over, and the head has left the path at the last rest: a machine takes it out of
    /// the part. Where it went is no part of the print, if the path ends there.
    void take_leave();
    /// At the end of the job.
    void sum_up(Findings& found) const;
    /// A person's line has changed what is asked behind those rests.
    void stretch(const AskedPath::Stretch& by);

  private:
    /// The comparison as it stood at a rest on the path.
    struct Remembered {
        Comparison so_far;
        std::deque<AskedPiece> pieces;
        Counts position{};
        std::uint64_t next = 0;  ///< the piece that was the next to be read
    };

    void come_back(std::size_t which);
    void forget_oldest();
    void note_near_miss();
    [[nodiscard]] bool is_clean_since(const Remembered& then) const;
    [[nodiscard]] bool is_on_path() const;
    [[nodiscard]] bool stands_at(const Remembered& then) const;
    [[nodiscard]] double extruder_limit() const {
        return kCleanExtruderSteps + cursor_.allowance().extruder_reach_steps();
    }

    PathCursor& cursor_;
    SeenMotors& motors_;
    // The newest last. More than one, because a way that begins along the path looks like the path.
    std::deque<Remembered> remembered_;
    std::int64_t pushed_away_ = 0;
    std::uint64_t since_rest_ = 0;  // steps of X and Y: a lift may be the path's and the way's
    bool away_ = false;
    bool counted_ = true;  // the excursion that was come back from last
};

}  // namespace qduino::twin
