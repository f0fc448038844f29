// The inspector when a person has typed a flow (M221) beside the job: the filament of what has been
// read is asked anew, from the place on that the machine reports.
//
//   E │            ╱ asked now      What is behind the place is changed, wherever it stands: in the
//     │          ╱   ╱ asked        pieces ahead, and in those that are remembered at a rest. The
//     │        ╱ ╱ ╱                machine plans ahead of its motors, so the place is ahead of
//     │      ●                      the cursor, too. In a simulator that is quicker than real time
//     └──────┴─────────── way       the twin may hear of it when the motors have been there. Then E
//          the place                was not wrong since: what was noted of it is forgotten.
#include <algorithm>
#include <cmath>

#include "twin/inspector.h"

namespace qduino::twin {
namespace {

constexpr double kNothing = 1e-9;

}  // namespace

void Inspector::on_typed(std::uint64_t behind_line, std::string_view line, double left_mm) {
    const std::optional<AskedPath::Stretch> by = asked_.insert(behind_line, line, left_mm);
    if (!by) return;
    read_to_[kExtruder] = by->moved(read_to_[kExtruder]);
    static_cast<void>(stretch(pieces_, *by, so_far_));
    for (Remembered& rest : remembered_) static_cast<void>(stretch(rest.pieces, *by, rest.so_far));
    Comparison none{};
    const std::size_t added = stretch(read_since_, *by, none);
    if (added > 0) {
        // What was read before a rest is in front of the piece that has come in.
        const std::uint64_t oldest = remembered_.front().pieces_read;
        for (Remembered& rest : remembered_)
            if (rest.pieces_read - oldest >= added) ++rest.pieces_read;
        ++pieces_read_;
    }
    const double deviation = std::abs(so_far_.built[kExtruder] - so_far_.at[kExtruder]);
    const double before = worst_extruder_before(by->line);
    if (so_far_.at[kExtruder] > by->from_mm * machine_.axes[kExtruder].steps_per_mm + kNothing)
        so_far_.worst[kExtruder] = std::max(before, deviation);
}

// Returns the place of a piece that has come in; 0: none has. `cursor` is on the first piece.
std::size_t Inspector::stretch(std::deque<Piece>& pieces, AskedPath::Stretch by, Comparison& cursor) const {
    const double steps_per_mm = machine_.axes[kExtruder].steps_per_mm;
    const auto moved = [&](double steps) { return by.moved(steps / steps_per_mm) * steps_per_mm; };
    std::size_t added = 0;
    for (std::size_t i = pieces.size(); i-- > 0;) {
        Piece& here = pieces[i];
        const double way_mm = (here.to[kExtruder] - here.from[kExtruder]) / steps_per_mm;
        const bool behind = here.line > by.line || here.kind == AskedItem::Kind::end;
        if (!behind && (here.line < by.line || std::abs(by.left_mm) < kNothing)) break;
        const double share = behind || way_mm == 0 ? 0 : 1 - by.left_mm / way_mm;
        if (share > kNothing && share < 1) {
            Piece rest = here;
            rest.from = point_on(here, share);
            rest.to[kExtruder] = moved(rest.to[kExtruder]);
            if (i == 0 && cursor.share > share) {
                here = rest;
                cursor.share = (cursor.share - share) / (1 - share);
            } else {
                here.to = rest.from;
                if (i == 0) cursor.share /= share;
                pieces.insert(pieces.begin() + static_cast<std::ptrdiff_t>(i) + 1, rest);
                added = i + 1;
            }
            break;
        }
        here.from[kExtruder] = moved(here.from[kExtruder]);
        here.to[kExtruder] = moved(here.to[kExtruder]);
        if (!behind) by.left_mm -= way_mm;
    }
    if (!pieces.empty()) cursor.at[kExtruder] = point_on(pieces.front(), cursor.share)[kExtruder];
    return added;
}

// The worst deviation of E, in steps, when the cursor came to that line.
double Inspector::worst_extruder_before(std::uint64_t line) const {
    const auto then = std::find_if(worst_extruder_.rbegin(), worst_extruder_.rend(),
                                   [&](const WorstExtruder& noted) { return noted.line <= line; });
    return then == worst_extruder_.rend() ? so_far_.worst[kExtruder] : then->steps;
}

void Inspector::note_worst_extruder() {
    const std::uint64_t line = pieces_.front().line;
    if (!worst_extruder_.empty() && worst_extruder_.back().line == line) return;
    worst_extruder_.push_back({line, so_far_.worst[kExtruder]});
    if (worst_extruder_.size() > AskedPath::kLineEnds) worst_extruder_.pop_front();
}

}  // namespace qduino::twin
