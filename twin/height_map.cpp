#include "twin/height_map.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace qduino::twin {
namespace {

// The way from one step to the next is at least this; less is rounding.
constexpr double kNoWayMm = 1e-9;

/// Keeps the `most` worst of `list`, the worst first.
template <typename Item>
void keep_worst(std::vector<Item>& list, const Item& item, double Item::*size, std::size_t most) {
    if (list.size() == most && list.back().*size >= item.*size) return;
    const auto smaller = [&](const Item& other) { return other.*size < item.*size; };
    list.insert(std::ranges::find_if(list, smaller), item);
    if (list.size() > most) list.pop_back();
}

}  // namespace

HeightMap::HeightMap(const Machine& machine, bool keep_cells)
    : melt_(machine.melt, machine.step_volume_mm3()),
      mm3_per_mm_(machine.step_volume_mm3() * machine.axes[kExtruder].steps_per_mm),
      width_mm_(machine.nozzle_diameter_mm),
      step_mm_(1 / std::min(machine.axes[0].steps_per_mm, machine.axes[1].steps_per_mm)),
      keep_cells_(keep_cells) {}

void HeightMap::slide_step(Instant now, const std::array<double, kAxisCount>& asked_mm, std::uint64_t line,
                           bool straight) {
    left_mm3_ += melt_.take(now);
    const double way_mm = std::hypot(asked_mm[0] - last_mm_[0], asked_mm[1] - last_mm_[1]);
    if (placed_ && way_mm < kNoWayMm) return;  // the path does not ask for this step
    // A retraction and its return ask for nothing.
    const double furthest_mm = placed_ ? std::max(furthest_mm_, asked_mm[kExtruder]) : asked_mm[kExtruder];
    const double asked_mm3 = (furthest_mm - std::exchange(furthest_mm_, furthest_mm)) * mm3_per_mm_;
    const Nanoseconds passed = now - at_;
    const double left_mm3 = std::exchange(left_mm3_, 0.0);
    const bool rested = !placed_ || passed >= kRest;
    const bool lays = placed_ && asked_mm3 > 0;
    if (rested || !lays) end_line();
    if (rested || lays) end_ooze();
    if (rested) {
        ooze(left_mm3, 0);
        end_ooze();
    }
    placed_ = true;
    at_ = now;
    last_mm_ = asked_mm;
    const bool same_line = place_.line == line;
    place_ = {{asked_mm[0], asked_mm[1], asked_mm[2]}, line};
    if (rested) return;
    if (!lays) return ooze(left_mm3, way_mm);
    lay({left_mm3, asked_mm3, way_mm, to_seconds(passed), place_, straight && same_line});
}

void HeightMap::leave_path(Instant now) {
    end_line();
    end_ooze();
    found_.rest_ooze_mm3 += melt_.take(now) + std::exchange(left_mm3_, 0.0);
    placed_ = false;
}

Heights HeightMap::finish(Instant now) {
    leave_path(now);
    found_.in_nozzle_mm3 = melt_.stored_mm3() + melt_.to_push_mm3();
    return std::move(found_);
}

// ---- where plastic is asked for -----------------------------------------------------------------

void HeightMap::Cell::add(const Cell& more) {
    volume_mm3 += more.volume_mm3;
    asked_mm3 += more.asked_mm3;
    way_mm += more.way_mm;
    seconds += more.seconds;
    end = more.end;
    straight = straight && more.straight;
}

void HeightMap::lay(const Cell& piece) {
    found_.laid_mm3 += piece.volume_mm3;
    found_.asked_mm3 += piece.asked_mm3;
    found_.way_mm += piece.way_mm;
    cell_.add(piece);
    if (cell_.way_mm >= kCellMm) end_cell();
    step_.add(piece);
    if (step_.way_mm < 0.999 * step_mm_) return;
    judge_step(step_);
    step_ = {};
}

// `next` is a whole step: was the one before it late?
void HeightMap::judge_step(const Cell& next) {
    if (!next.straight) {
        whole_ = 0;
        return;
    }
    const Cell& first = before_[0];
    const Cell& middle = before_[1];
    if (whole_ == 2) {
        const double late_s = middle.seconds - middle.way_mm * std::max(first.pace(), next.pace());
        const double rise_mm = middle.volume_mm3 * late_s / middle.seconds / (width_mm_ * middle.way_mm);
        if (late_s > 0 && rise_mm > kSpotShare * middle.asked_mm3 / (width_mm_ * middle.way_mm)) {
            ++found_.late_spot_count;
            keep_worst(found_.late_spots, {middle.end, late_s, rise_mm}, &LateSpot::rise_mm, kWorst);
        }
    }
    before_ = {middle, next};
    whole_ = std::min(whole_ + 1, 2);
}

void HeightMap::end_line() {
    if (cell_.way_mm >= kCellMm / 2) end_cell();
    cell_ = step_ = {};
    whole_ = 0;
    joined_ = false;
}

void HeightMap::end_cell() {
    const double built_mm = cell_.volume_mm3 / (width_mm_ * cell_.way_mm);
    const double asked_mm = cell_.asked_mm3 / (width_mm_ * cell_.way_mm);
    const double error_mm = built_mm - asked_mm;
    found_.error_nm.record(std::llround(std::abs(error_mm) * 1e6));
    if (std::abs(error_mm) > std::abs(found_.worst_error_mm)) {
        found_.worst_error_mm = error_mm;
        found_.worst = cell_.end;
    }
    if (keep_cells_) keep_cell(error_mm / asked_mm);
    cell_ = {};
}

// A list that is full loses every second cell, and from then on half as many are kept.
void HeightMap::keep_cell(double error) {
    if (passed_++ % every_ != 0) return;
    if (found_.cells.size() == kCellLimit) {
        for (std::size_t i = 0; i < kCellLimit / 2; ++i) found_.cells[i] = found_.cells[2 * i];
        found_.cells.resize(kCellLimit / 2);
        every_ *= 2;
    }
    const auto& mm = cell_.end.mm;
    found_.cells.push_back({static_cast<float>(mm[0]), static_cast<float>(mm[1]), static_cast<float>(mm[2]),
                            static_cast<float>(error), joined_});
    joined_ = true;
}

// ---- where none is ------------------------------------------------------------------------------

void HeightMap::ooze(double volume_mm3, double way_mm) {
    if (ooze_.volume_mm3 == 0 && ooze_.way_mm == 0) ooze_.from = place_;
    ooze_.volume_mm3 += volume_mm3;
    ooze_.way_mm += way_mm;
}

void HeightMap::end_ooze() {
    (ooze_.way_mm > 0 ? found_.travel_ooze_mm3 : found_.rest_ooze_mm3) += ooze_.volume_mm3;
    if (ooze_.volume_mm3 > 0) keep_worst(found_.oozes, ooze_, &Ooze::volume_mm3, kWorst);
    ooze_ = {};
}

}  // namespace qduino::twin
