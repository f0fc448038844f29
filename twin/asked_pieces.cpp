#include "twin/asked_pieces.h"

#include <algorithm>
#include <cmath>

namespace qduino::twin {
namespace {

constexpr double kNothing = 1e-9;

}  // namespace

std::size_t stretch(std::deque<AskedPiece>& pieces, AskedPath::Stretch by, double steps_per_mm,
                    double& share) {
    const auto moved = [&](double steps) { return by.moved(steps / steps_per_mm) * steps_per_mm; };
    for (std::size_t i = pieces.size(); i-- > 0;) {
        AskedPiece& here = pieces[i];
        const double way_mm = (here.to[kExtruder] - here.from[kExtruder]) / steps_per_mm;
        const bool behind = here.line > by.line || here.kind == AskedItem::Kind::end;
        if (!behind && (here.line < by.line || std::abs(by.left_mm) < kNothing)) break;
        const double cut = behind || way_mm == 0 ? 0 : 1 - by.left_mm / way_mm;
        if (cut > kNothing && cut < 1) {
            AskedPiece rest = here;
            rest.from = here.at(cut);
            rest.to[kExtruder] = moved(rest.to[kExtruder]);
            if (i == 0 && share > cut) {
                here = rest;
                share = (share - cut) / (1 - cut);
                return 0;
            }
            here.to = rest.from;
            if (i == 0) share /= cut;
            pieces.insert(pieces.begin() + static_cast<std::ptrdiff_t>(i) + 1, rest);
            return i + 1;
        }
        here.from[kExtruder] = moved(here.from[kExtruder]);
        here.to[kExtruder] = moved(here.to[kExtruder]);
        if (!behind) by.left_mm -= way_mm;
    }
    return 0;
}

AskedPieces::AskedPieces(const Machine& machine, ByteSource& source, const InspectionStart& start)
    : space_(machine, start.maps),
      asked_(source, start.asked_mm, machine, Compensation{machine}, start.bed),
      read_to_(start.asked_mm),
      chord_mm_(kChordSteps / std::max({machine.axes[0].steps_per_mm, machine.axes[1].steps_per_mm,
                                        machine.axes[2].steps_per_mm})) {
    const MotorPoint at = place_at_start(start);
    allowance_.widen_turn(space_, start.asked_mm);
    pieces_.push_back({AskedItem::Kind::move, 0, false, 0, at, at, 0});
    widen_reach();
}

// Where the path has it, or as the switches have left it: their places are not corrected.
MotorPoint AskedPieces::place_at_start(const InspectionStart& start) const {
    const MotorPoint by_path = space_.to_steps(space_.corrected(start.asked_mm, start.bed.now()));
    const MotorPoint by_switches = space_.to_steps(start.asked_mm);
    const auto off = [&](const MotorPoint& place) {
        double most = 0;
        for (std::size_t axis = 0; axis < kSlideCount; ++axis)
            most = std::max(
                most, std::abs(static_cast<double>(start.built[axis]) - start.origin[axis] - place[axis]));
        return most;
    };
    return off(by_switches) < off(by_path) ? by_switches : by_path;
}

// The next item of the path, in pieces that are straight for every motor. A correction that has
// changed first moves the nozzle where it stands.
void AskedPieces::read_item() {
    const AskedItem item = asked_.next();
    if (asked_.compensation().changes() != filters_seen_) widen_reach();
    const MotorPoint last = pieces_.back().to;
    if (item.kind == AskedItem::Kind::move) {
        const MotorPoint begin = space_.to_steps(space_.corrected(read_to_, item.correction));
        for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
            if (std::abs(begin[axis] - last[axis]) < kTieSteps) continue;
            push({item.kind, 0, false, item.line, last, begin, 0});
            break;
        }
        push_way(item);
    } else {
        const bool ends = item.kind == AskedItem::Kind::end;
        push({item.kind, item.homed, false, item.line, last, ends ? last : space_.to_steps(home_from(item)),
              0});
    }
    read_to_ = item.to;
}

void AskedPieces::push_way(const AskedItem& item) {
    const Position& from = read_to_;
    const double way_mm = std::hypot(item.to[0] - from[0], item.to[1] - from[1]);
    const bool bent = space_.follows_bed(item.correction) && way_mm > 0;
    allowance_.widen_turn(space_, item.to);
    int count = space_.gantry().pieces_of(from, item.to, chord_mm_);
    if (bent) count = std::max(count, static_cast<int>(std::ceil(way_mm / kBedPieceMm)));
    for (int i = 1; i <= count; ++i) {
        Position to = item.to;
        for (std::size_t axis = 0; axis < kAxisCount && i < count; ++axis)
            to[axis] = from[axis] + (item.to[axis] - from[axis]) * i / count;
        const MotorPoint end = space_.to_steps(space_.corrected(to, item.correction));
        push({item.kind, 0, item.curved || bent, item.line, pieces_.back().to, end, item.advance_s,
              item.correction.follows_bed ? item.correction.map : 0, item.correction.fade_end_mm});
    }
}

// Where the nozzle is after a G28 or a G29: its switches' places are the machine's, not corrected.
Position AskedPieces::home_from(const AskedItem& item) const {
    if (item.kind == AskedItem::Kind::probe || !item.correction.active()) return item.to;
    Position at = space_.to_mm(pieces_.back().to);
    for (std::size_t axis = 0; axis < kSlideCount; ++axis)
        if ((item.homed >> axis & 1u) != 0) at[axis] = item.to[axis];
    return at;
}

void AskedPieces::widen_reach() {
    filters_seen_ = asked_.compensation().changes();
    allowance_.widen_reach(space_, asked_.compensation());
}

std::optional<AskedPath::Stretch> AskedPieces::insert(std::uint64_t behind, std::string_view line,
                                                      double left_mm) {
    const std::optional<AskedPath::Stretch> by = asked_.insert(behind, line, left_mm);
    if (by) read_to_[kExtruder] = by->moved(read_to_[kExtruder]);
    return by;
}

}  // namespace qduino::twin
