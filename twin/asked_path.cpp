#include "twin/asked_path.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace qduino::twin {

AskedItem AskedPath::next() {
    AskedItem item;
    while (arc_.active) {
        const int chord = ++arc_.chord;
        if (chord >= arc_.chords) arc_.active = false;
        if (emit(arc_point(chord), item)) return item;
    }
    while (const std::optional<CommandLine> command = lines_.next())
        if (run(*command, item)) return item;
    return {AskedItem::Kind::end, 0, lines_.number(), machine_};
}

bool AskedPath::run(const CommandLine& command, AskedItem& item) {
    if (command.letter == 'G' && command.subcode == 0) return run_g(command, item);
    // G92.1: the machine's own coordinates again.
    if (command.letter == 'G' && command.number == 92 && command.subcode == 1) offset_ = {};
    if (command.letter != 'M') return false;
    if (command.number == 82 || command.number == 83) relative_e_ = command.number == 83;
    if (command.number == 221 && command.has('S')) flow_ = command.value('S') / 100.0;
    return false;
}

bool AskedPath::run_g(const CommandLine& command, AskedItem& item) {
    switch (command.number) {
        case 0:
        case 1:
            return emit(target(command), item);
        case 2:
        case 3:
            return begin_arc(command, command.number == 2, item);
        case 20:
        case 21:
            unit_mm_ = command.number == 20 ? 25.4 : 1;
            return false;
        case 28:
            return home(command, item);
        case 90:
        case 91:
            relative_ = relative_e_ = command.number == 91;
            return false;
        case 92:
            rename(command);
            return false;
        default:
            return false;
    }
}

Position AskedPath::target(const CommandLine& command) {
    Position to = machine_;
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
        const char letter = kAxisLetter[axis];
        if (!command.has(letter)) continue;
        const double word = command.value(letter) * unit_mm_;
        to[axis] = relative_ ? machine_[axis] + word : word + offset_[axis];
    }
    if (command.has('E')) {
        const double word = command.value('E') * unit_mm_;
        const double delta = relative_e_ ? word : word - logical_e_;
        logical_e_ += delta;
        to[kExtruder] += delta * flow_;
    }
    return to;
}

bool AskedPath::emit(const Position& to, AskedItem& item) {
    const double filament = to[kExtruder] - machine_[kExtruder];
    filament_net_mm_ += filament;
    filament_pushed_mm_ += std::max(filament, 0.0);
    if (to == machine_) return false;
    machine_ = to;
    item = {AskedItem::Kind::move, 0, lines_.number(), to};
    return true;
}

bool AskedPath::home(const CommandLine& command, AskedItem& item) {
    std::uint8_t mask = 0;
    for (std::size_t axis = 0; axis < kSlideCount; ++axis)
        if (command.has(kAxisLetter[axis])) mask = static_cast<std::uint8_t>(mask | 1u << axis);
    if (mask == 0) mask = 0b111;
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
        if ((mask >> axis & 1u) == 0) continue;
        machine_[axis] = home_mm_[axis];
        offset_[axis] = 0;
    }
    item = {AskedItem::Kind::home, mask, lines_.number(), machine_};
    return true;
}

void AskedPath::rename(const CommandLine& command) {
    bool all = !command.has('E');  // without a letter: every axis, to 0
    for (const char letter : kAxisLetter) all = all && !command.has(letter);
    const auto word_mm = [&](char letter) { return all ? 0.0 : command.value(letter) * unit_mm_; };
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
        const char letter = kAxisLetter[axis];
        if (all || command.has(letter)) offset_[axis] = machine_[axis] - word_mm(letter);
    }
    if (all || command.has('E')) logical_e_ = word_mm('E');
}

// G2/G3 in the XY plane. I J: the centre relative to the start. R: of the two arcs with that
// radius, the shorter (R > 0) or the longer (R < 0); its centre lies on the chord's bisector, at
// sqrt(R² − (chord/2)²) from the middle.
bool AskedPath::begin_arc(const CommandLine& command, bool clockwise, AskedItem& item) {
    Arc arc;
    arc.from = machine_;
    arc.to = target(command);
    const double dx = arc.to[0] - arc.from[0];
    const double dy = arc.to[1] - arc.from[1];
    if (command.has('R')) {
        const double radius = command.value('R') * unit_mm_;
        const double chord = std::hypot(dx, dy);
        if (chord == 0) return emit(arc.to, item);
        const double rise = std::sqrt(std::max(radius * radius - chord * chord / 4, 0.0));
        const double side = clockwise == (radius > 0) ? -1.0 : 1.0;  // left of the chord is +1
        arc.centre_x = arc.from[0] + dx / 2 - side * rise * dy / chord;
        arc.centre_y = arc.from[1] + dy / 2 + side * rise * dx / chord;
    } else {
        arc.centre_x = arc.from[0] + command.value('I') * unit_mm_;
        arc.centre_y = arc.from[1] + command.value('J') * unit_mm_;
    }
    arc.radius = std::hypot(arc.from[0] - arc.centre_x, arc.from[1] - arc.centre_y);
    if (arc.radius == 0) return emit(arc.to, item);
    arc.start_angle = std::atan2(arc.from[1] - arc.centre_y, arc.from[0] - arc.centre_x);
    const double end_angle = std::atan2(arc.to[1] - arc.centre_y, arc.to[0] - arc.centre_x);
    constexpr double kTurn = 2 * std::numbers::pi;
    arc.sweep = end_angle - arc.start_angle;
    if (dx == 0 && dy == 0) arc.sweep = 0;  // back to the start: a whole turn
    if (clockwise && arc.sweep >= 0) arc.sweep -= kTurn;
    if (!clockwise && arc.sweep <= 0) arc.sweep += kTurn;
    // A chord over angle φ leaves its arc by r (1 − cos φ/2), about r φ²/8.
    const double angle = std::sqrt(8 * kChordErrorMm / arc.radius);
    arc.chords = std::clamp(static_cast<int>(std::ceil(std::abs(arc.sweep) / angle)), 1, 1'000'000);
    arc.active = true;
    arc_ = arc;
    item = next();
    return true;
}

Position AskedPath::arc_point(int chord) const {
    if (chord >= arc_.chords) return arc_.to;
    const double share = static_cast<double>(chord) / arc_.chords;
    Position point;
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
        point[axis] = arc_.from[axis] + share * (arc_.to[axis] - arc_.from[axis]);
    const double angle = arc_.start_angle + share * arc_.sweep;
    point[0] = arc_.centre_x + arc_.radius * std::cos(angle);
    point[1] = arc_.centre_y + arc_.radius * std::sin(angle);
    return point;
}

}  // namespace qduino::twin
