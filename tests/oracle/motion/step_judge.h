// Are these the steps of a motor? Its steps are held against its place at any time
// (sampled_motors.h), as they come.
//
//   place ^           .-·-.
//   k+3/2 |- - - - -.-'-·-'-.- - -       a step is right when the place crosses its half-step
//   k+1/2 |- - -.-'·    :    ·'-.        within 50 ns of it
//         |_.-'·   ·    :    ·   ·'-
//         +---|----|----|----|----|--> time
//          samples: the count is the place, rounded; but for a pair there and back nearer in time
//          than the machine's gap, which is not made
//
// Steps of the right kind at the right instants, and a count that fits everywhere between them: so
// no step is missing, doubled or in another order. Samples lie nearer than the gap, so no pair that
// is to be made stays unseen. Where the gap is shorter than the grid, the turns are searched for
// as well.
//
// Where a motor nearly stands, the instant of a crossing is ill-conditioned: a rounding error of
// the place is 1e-13 mm, and where the speed passes through 0 any instant will do. There the place
// is asked to be right, to a millionth of a step. The same holds for a motor that rests on a
// half-step: either count is right.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <string>

#include "base/text.h"
#include "printer/step/step_event.h"
#include "tests/oracle/motion/sampled_motors.h"

namespace qduino::test {

/// What was judged, of one motor or of all.
struct Judged {
    std::uint64_t steps = 0;
    std::uint64_t ill_conditioned = 0;  ///< right by their place, not by their instant
    std::uint64_t pairs = 0;            ///< there and back, rightly left out
    double worst_ns = 0;                ///< from its crossing, of the well-conditioned ones
    std::string wrong;                  ///< what was wrong first; empty: nothing

    void add(const Judged& other) {
        steps += other.steps;
        ill_conditioned += other.ill_conditioned;
        pairs += other.pairs;
        worst_ns = std::max(worst_ns, other.worst_ns);
        if (wrong.empty()) wrong = other.wrong;
    }
};

class StepJudge {
  public:
    static constexpr Real kInstant_s = 50e-9L;
    static constexpr Real kPlaceSteps = 1e-6L;
    /// Both steps of a pair stand on whole nanoseconds.
    static constexpr Real kRounding_s = 2e-9L;

    /// From time 0 on, with the motor at `count`. `motors` outlives this. Steps there and back
    /// that are nearer than `gap_s` are not made.
    StepJudge(const SampledMotors& motors, std::size_t motor, std::int64_t count, Real gap_s, Real grid_s)
        : motors_(motors), motor_(motor), count_(count), gap_s_(gap_s), grid_s_(grid_s) {
        before_ = last_ = sample(0);
        at(last_);
    }

    [[nodiscard]] std::int64_t count() const { return count_; }
    [[nodiscard]] const Judged& judged() const { return judged_; }

    /// The next step of this motor.
    void add(const printer::step::StepEvent& step) { steps_.push_back(step); }
    /// Judges up to `until_s`: every step before it has been added, and the motion is known.
    void judge(Real until_s) {
        for (; judged_.wrong.empty() && last_.at_s + grid_s_ < until_s;) {
            const Sample next = sample(last_.at_s + grid_s_);
            const bool turns = (last_.place - before_.place) * (next.place - last_.place) < 0;
            if (turns && gap_s_ < grid_s_) {
                const Sample turn = turn_between(before_, next);
                // The samples on both sides of it lie within the grid.
                if (turn.at_s < last_.at_s) {
                    at(turn);
                    at(last_);
                } else {
                    at(last_);
                    at(turn);
                }
            } else {
                at(last_);
            }
            before_ = last_;
            last_ = next;
        }
    }

  private:
    struct Sample {
        Real at_s = 0;
        Real place = 0;  // in steps
    };

    [[nodiscard]] Sample sample(Real at_s) const { return {at_s, motors_.steps(motor_, at_s)}; }
    [[nodiscard]] bool fits(Real place) const {
        return std::abs(place - static_cast<Real>(count_)) <= Real{0.5} + kPlaceSteps;
    }

    /// One place of the motor, and the steps before it.
    void at(const Sample& here) {
        if (here.at_s < inside_s_) return;
        for (; !steps_.empty() && judged_.wrong.empty(); steps_.pop_front()) {
            const Real step_s = static_cast<Real>(steps_.front().time_ns) * 1e-9L;
            if (step_s > here.at_s) break;
            take(steps_.front(), step_s);
        }
        if (!judged_.wrong.empty()) return;
        if (fits(here.place)) {
            if (outside_) end_outside(boundary(outside_s_, here.at_s));
            inside_s_ = here.at_s;
            return;
        }
        if (!outside_) left_s_ = boundary(here.at_s, inside_s_);
        outside_ = true;
        outside_s_ = here.at_s;
        if (outside_s_ - left_s_ >= 4 * gap_s_) end_outside(outside_s_);
    }

    void take(const printer::step::StepEvent& step, Real step_s) {
        ++judged_.steps;
        const int way = step.direction;
        const Real half = static_cast<Real>(count_) + Real{0.5} * way;
        const Real early = (motors_.steps(motor_, step_s - kInstant_s) - half) * way;
        const Real late = (motors_.steps(motor_, step_s + kInstant_s) - half) * way;
        if (early > 0 || late < 0) {
            ++judged_.ill_conditioned;
            const Real off = std::abs(motors_.steps(motor_, step_s) - half);
            if (off > kPlaceSteps)
                return complain(step_s, "a step is not where the motor crosses, by microsteps: ", off);
        } else if (late > early) {
            const Real off_s = (early + late) / (late - early) * kInstant_s;
            judged_.worst_ns = std::max(judged_.worst_ns, std::abs(static_cast<double>(off_s * 1e9L)));
        }
        if (last_way_ == -way && step_s - last_step_s_ < gap_s_ - kRounding_s)
            return complain(step_s, "a pair of steps is nearer than the gap, by ns: ",
                            (gap_s_ - (step_s - last_step_s_)) * 1e9L);
        if (outside_) end_outside(step_s);
        count_ += way;
        last_way_ = way;
        last_step_s_ = inside_s_ = step_s;
    }

    /// The motor was where its count is not, up to `back_s`. It may have been back between two
    /// samples, so a stay that is too long is looked at closely.
    void end_outside(Real back_s) {
        outside_ = false;
        inside_s_ = back_s;
        Real away_s = back_s - left_s_;
        if (away_s >= gap_s_) away_s = longest_stay(left_s_, back_s);
        if (away_s >= gap_s_ + kRounding_s)
            return complain(left_s_, "a step is missing, for so many ms: ", away_s * 1e3L);
        if (away_s > kInstant_s) ++judged_.pairs;
    }
    [[nodiscard]] Real longest_stay(Real from_s, Real to_s) const {
        const Real near_s = gap_s_ / 200;
        Real longest_s = 0, began_s = from_s;
        for (Real here_s = from_s; here_s < to_s; here_s += near_s) {
            if (!fits(motors_.steps(motor_, here_s))) continue;
            longest_s = std::max(longest_s, here_s - began_s);
            began_s = here_s;
        }
        return std::max(longest_s, to_s - began_s);
    }

    void complain(Real at_s, std::string_view what, Real number) {
        judged_.wrong = text<std::string>("motor ", motor_, " at ", Fixed{static_cast<double>(at_s), 9},
                                          " s: ", what, Fixed{static_cast<double>(number), 6});
    }

    /// Between a place that does not fit the count and one that does: where it begins to.
    [[nodiscard]] Real boundary(Real outside_s, Real inside_s) const {
        for (int i = 0; i < 40; ++i) {
            const Real middle = (outside_s + inside_s) / 2;
            (fits(motors_.steps(motor_, middle)) ? inside_s : outside_s) = middle;
        }
        return inside_s;
    }

    /// The furthest place between two samples that both lie behind it.
    [[nodiscard]] Sample turn_between(Sample low, Sample high) const {
        const Real middle = sample((low.at_s + high.at_s) / 2).place;
        const bool top = middle > low.place || middle > high.place;
        for (int i = 0; i < 40; ++i) {
            const Real third = (high.at_s - low.at_s) / 3;
            const Sample a = sample(low.at_s + third), b = sample(high.at_s - third);
            ((a.place < b.place) == top ? low : high) = (a.place < b.place) == top ? a : b;
        }
        return low;
    }

    const SampledMotors& motors_;
    std::size_t motor_;
    std::int64_t count_;
    Real gap_s_;
    Real grid_s_;
    std::deque<printer::step::StepEvent> steps_;  // added, not judged
    Sample before_, last_;                        // the two newest samples
    Real inside_s_ = 0;                           // the count was right here, last
    bool outside_ = false;                        // since left_s_, and still at outside_s_
    Real left_s_ = 0;
    Real outside_s_ = 0;
    int last_way_ = 0;
    Real last_step_s_ = 0;
    Judged judged_;
};

}  // namespace qduino::test
