#include "twin/excursions.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace qduino::twin {

void Excursions::rest() {
    for (std::size_t i = remembered_.size(); i-- > 0;) {
        if (!stands_at(remembered_[i])) continue;
        if (!is_clean_since(remembered_[i])) return come_back(i);
        break;
    }
    if (is_on_path()) {
        KeptPieces& kept = cursor_.pieces().kept();
        kept.keep();
        remembered_.push_back({cursor_.so_far(), cursor_.pieces().all(), motors_.position, kept.next()});
        if (remembered_.size() > kRests) forget_oldest();
    } else if (!remembered_.empty()) {
        note_near_miss();
    }
}

bool Excursions::stands_at(const Remembered& then) const {
    return std::equal(motors_.position.begin(), motors_.position.begin() + kSlideCount,
                      then.position.begin());
}

bool Excursions::begins_at_rest(const MotorStep& step) const {
    if (remembered_.empty()) return false;
    Counts before = motors_.position;
    before[step.axis] -= step.direction > 0 ? 1 : -1;
    return std::equal(before.begin(), before.begin() + kSlideCount, remembered_.back().position.begin());
}

bool Excursions::is_on_path() const {
    const Comparison& so_far = cursor_.so_far();
    if (away_ || so_far.unexplained_run != 0) return false;
    for (std::size_t axis = 0; axis < kSlideCount; ++axis)
        if (so_far.off(axis) > kCleanSteps) return false;
    return so_far.off(kExtruder) <= extruder_limit();
}

// True when the path has explained every step since.
bool Excursions::is_clean_since(const Remembered& then) const {
    if (away_) return false;
    const Comparison& so_far = cursor_.so_far();
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
        if (so_far.findings.axes[axis].unexplained != then.so_far.findings.axes[axis].unexplained)
            return false;
    }
    return std::max(so_far.worst[kExtruder], so_far.worst_curved[kExtruder]) <=
           std::max({then.so_far.worst[kExtruder], then.so_far.worst_curved[kExtruder], extruder_limit()});
}

void Excursions::forget_oldest() {
    remembered_.pop_front();
    KeptPieces& kept = cursor_.pieces().kept();
    remembered_.empty() ? kept.forget_all() : kept.forget_before(remembered_.front().next);
}

void Excursions::forget_but(std::size_t count) {
    while (remembered_.size() > count) forget_oldest();
}

// The excursion seems over. It is counted when the path goes on: until then the head may only rest
// where it left.
void Excursions::come_back(std::size_t which) {
    const Remembered& then = remembered_[which];
    const Findings seen = cursor_.so_far().findings;
    cursor_.stand_at(then.so_far, then.pieces, then.next);
    Comparison& so_far = cursor_.so_far();
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
        so_far.findings.axes[axis].steps = seen.axes[axis].steps;
    // E counts on from where it left.
    const double origin = static_cast<double>(motors_.position[kExtruder]) - so_far.built[kExtruder];
    pushed_away_ += std::llround(origin - motors_.origin[kExtruder]);
    motors_.origin[kExtruder] = origin;
    remembered_.resize(which + 1);
    away_ = false;
    counted_ = false;
}

void Excursions::take_leave() {
    if (!differs()) return;
    const PathCursor cursor = cursor_;
    const SeenMotors motors = motors_;
    const Excursions before = *this;
    motors_.position = remembered_.back().position;
    come_back(remembered_.size() - 1);
    if (cursor_.pass_rest()) return;
    // It does not: the comparison stands as it did, but for what has been read of the file
    // meanwhile.
    cursor_.take_back(cursor);
    motors_ = motors;
    remembered_ = before.remembered_;
    pushed_away_ = before.pushed_away_;
    away_ = before.away_;
    counted_ = before.counted_;
}

// At rest beside the place where it left: keeps the distance for the report.
void Excursions::note_near_miss() {
    std::array<std::int64_t, kSlideCount> beside{};
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
        beside[axis] = motors_.position[axis] - remembered_.back().position[axis];
        if (std::abs(beside[axis]) > kNearSteps) return;
    }
    cursor_.so_far().findings.beside_steps = beside;
}

void Excursions::goes_on() {
    if (!counted_) ++cursor_.so_far().findings.excursions;
    counted_ = true;
    // No head leaves the path from so far behind: what is remembered is useless by now, and would
    // grow.
    while (cursor_.pieces().kept().size() > 2 * PathCursor::kLookAhead) forget_oldest();
}

bool Excursions::leaves(std::size_t axis) const {
    if (remembered_.empty() || since_rest_ > kAwayWithinSteps) return false;
    const Comparison& so_far = cursor_.so_far();
    if (axis != kExtruder) return so_far.unexplained_run >= PathCursor::kAwaySteps;
    return stands_at(remembered_.back()) &&
           so_far.off(kExtruder) >=
               static_cast<double>(PathCursor::kAwaySteps) + cursor_.allowance().extruder_reach_steps();
}

void Excursions::sum_up(Findings& found) const {
    if (!counted_) ++found.excursions;
    found.away = away_;
    found.left_line = remembered_.empty() ? 0 : remembered_.back().pieces.front().line;
}

void Excursions::stretch(const AskedPath::Stretch& by) {
    const double steps_per_mm = cursor_.steps_per_mm(kExtruder);
    for (Remembered& rest : remembered_) {
        static_cast<void>(twin::stretch(rest.pieces, by, steps_per_mm, rest.so_far.share));
        rest.so_far.at[kExtruder] = rest.pieces.front().at(rest.so_far.share)[kExtruder];
    }
    // What was read before a rest is in front of the piece that has come in.
    const std::uint64_t from = cursor_.pieces().kept().stretch(by, steps_per_mm);
    for (Remembered& rest : remembered_)
        if (rest.next >= from) ++rest.next;
}

}  // namespace qduino::twin
