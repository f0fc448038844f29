#include "printer/step/axis_path.h"

#include <algorithm>

namespace qduino::printer::step {
namespace {

constexpr std::size_t kHere = 1;  // of the second difference: t + h, t, t − h
constexpr std::array<double, 3> kSecondDifference{1, -2, 1};
/// k!/(k+2)!: what integrating t^k twice makes of it.
constexpr std::array<double, 4> kIntegratedTwice{1.0 / 2, 1.0 / 6, 1.0 / 12, 1.0 / 20};

}  // namespace

void AxisPath::set_filter(const motion::Impulses& impulses, double half_smoothing_s) {
    half_s_ = half_smoothing_s;
    copies_ = half_s_ > 0 ? kSecondDifference.size() : impulses.count;
    share_ = impulses.share;
    ahead_s_ = impulses.ahead_s;
    if (half_s_ > 0) ahead_s_ = {half_s_, 0, -half_s_};
}

void AxisPath::begin(const MotionTrack& track, std::size_t axis, double at_s) {
    axis_ = axis;
    cursors_.fill(track.first());
    start_s_ = end_s_ = at_s;
    position_ = Polynomial{{track.piece(track.first()).at_mm[axis]}};
    since_sum_ = kSumEvery;
    for (std::size_t copy = 0; copy < copies_; ++copy)
        while (edge(track, copy) <= at_s && track.has(cursors_[copy] + 1)) ++cursors_[copy];
}

bool AxisPath::next(const MotionTrack& track) {
    for (std::size_t copy = 0; copy < copies_; ++copy)
        if (edge(track, copy) <= end_s_ && !track.has(cursors_[copy] + 1)) return false;
    if (half_s_ > 0) position_.shift(end_s_ - start_s_);
    start_s_ = end_s_;
    for (std::size_t copy = 0; copy < copies_; ++copy)
        while (edge(track, copy) <= start_s_ && track.has(cursors_[copy] + 1)) cross(track, copy);
    if (half_s_ <= 0) {
        add_copies(track);
    } else if (cursors_[0] - cursors_[2] <= kFewEnds || ++since_sum_ >= kSumEvery) {
        smooth_anew(track);
    }
    find_end(track);
    return true;
}

void AxisPath::find_end(const MotionTrack& track) {
    end_s_ = edge(track, 0);
    for (std::size_t copy = 1; copy < copies_; ++copy) end_s_ = std::min(end_s_, edge(track, copy));
    end_s_ = std::max(end_s_, start_s_);
}

void AxisPath::add_copies(const MotionTrack& track) {
    position_ = Polynomial{};
    for (std::size_t copy = 0; copy < copies_; ++copy) {
        const MotionPiece& piece = track.piece(cursors_[copy]);
        const auto at = piece.position(axis_, start_s_ + ahead_s_[copy] - piece.start_s);
        for (std::size_t i = 0; i < at.size(); ++i) position_.c[i] += share_[copy] * at[i];
    }
}

// ---- smoothing ----------------------------------------------------------------------------------

/// The edge of the next piece: the copy's cursor goes on, and the sum changes by what changes
/// there.
void AxisPath::cross(const MotionTrack& track, std::size_t copy) {
    ++cursors_[copy];
    if (half_s_ > 0) position_.add(change_at(track, cursors_[copy]), kSecondDifference[copy]);
}

/// Coefficients of the place plus advance times the speed.
std::array<double, 4> AxisPath::pressed(const MotionPiece& piece, double after_s) const {
    auto at = piece.position(axis_, after_s);
    for (std::size_t i = 0; i + 1 < at.size(); ++i)
        at[i] += piece.advance_s * static_cast<double>(i + 1) * at[i + 1];
    return at;
}

/// What changes where piece `number` begins, integrated twice, over h²: of the time since then.
Polynomial AxisPath::change_at(const MotionTrack& track, std::uint64_t number) const {
    const MotionPiece& before = track.piece(number - 1);
    const MotionPiece& after = track.piece(number);
    const auto left = pressed(before, after.start_s - before.start_s);
    const auto entered = pressed(after, 0);
    Polynomial change;
    for (std::size_t i = 0; i < left.size(); ++i)
        change.c[i + 2] = (entered[i] - left[i]) * kIntegratedTwice[i] / (half_s_ * half_s_);
    return change;
}

void AxisPath::smooth_anew(const MotionTrack& track) {
    since_sum_ = 0;
    const MotionPiece& here = track.piece(cursors_[kHere]);
    const auto at = pressed(here, start_s_ - here.start_s);
    const double h2 = half_s_ * half_s_;
    position_ = Polynomial{{at[0] + h2 / 6 * at[2], at[1] + h2 / 2 * at[3], at[2], at[3]}};
    for (std::uint64_t b = cursors_[kHere] + 1; b <= cursors_[0]; ++b)
        position_.add(change_at(track, b).shifted(start_s_ + half_s_ - track.start_of(b)));
    for (std::uint64_t b = cursors_[2] + 1; b <= cursors_[kHere]; ++b) {
        // The change is a polynomial of b − t + h, so its odd terms are mirrored twice: once for
        // (−1)^k and once for the time.
        const Polynomial change = change_at(track, b).mirrored();
        position_.add(change.shifted(track.start_of(b) - start_s_ + half_s_).mirrored(), -1);
    }
}

}  // namespace qduino::printer::step
