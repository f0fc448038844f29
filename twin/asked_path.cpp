#include "twin/asked_path.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "twin/gantry.h"

namespace qduino::twin {
namespace {

constexpr double kInchMm = 25.4;
/// M428 takes a place for the switch's when it is no further from it.
constexpr double kReferenceMm = 20;

void read_mm(const CommandLine& command, char letter, double unit_mm, double& mm) {
    if (command.has(letter)) mm = command.value(letter) * unit_mm;
}

/// A mask of the slides whose letters are there.
std::uint8_t named_slides(const CommandLine& command) {
    std::uint8_t mask = 0;
    for (std::size_t axis = 0; axis < kSlideCount; ++axis)
        if (command.has(kAxisLetter[axis])) mask = static_cast<std::uint8_t>(mask | 1u << axis);
    return mask;
}

}  // namespace

AskedPath::AskedPath(ByteSource& source, const Position& start, const Machine& machine,
                     const Compensation& compensation, const AskedBed& bed)
    : lines_(source, machine.macros),
      compensation_(compensation),
      bed_(bed),
      gantry_(machine),
      program_(start),
      machine_(start),
      flavour_(machine.flavour),
      out_(start) {
    filament_.peak_mm = start[kExtruder];
    filament_.diameter_mm = machine.filament_diameter_mm;
    filament_.steps_per_mm = machine.axes[kExtruder].steps_per_mm;
    const Position home = home_of(machine);
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) known_.home_mm[axis] = home[axis];
    // Rows go to and fro, so after an odd number of them the head is at the far end of the last.
    const GridSpec& grid = machine.grid;
    known_.probed_at[0] =
        (grid.points[1] % 2 != 0 ? grid.maximum_mm : grid.minimum_mm)[0] - machine.probe.x_offset_mm;
    known_.probed_at[1] = grid.maximum_mm[1] - machine.probe.y_offset_mm;
    known_.probed_at[2] = grid.clearance_mm;
}

AskedItem AskedPath::next() {
    for (;;) {
        if (!given_.empty()) {
            const AskedItem item = given_.front();
            given_.pop_front();
            out_ = item.to;
            return item;
        }
        if (curve_.active()) {
            follow(curve_.next(), true);
            continue;
        }
        note_line_end();
        const std::optional<CommandLine> command = end_.over ? std::nullopt : lines_.next();
        if (command) {
            run(*command);
            run_typed();
        } else if (!end_.given) {
            end_.given = true;
            leave_part();
        } else {
            return {AskedItem::Kind::end, 0, false, lines_.number(), machine_, 0, bed_.now()};
        }
    }
}

void AskedPath::run(const CommandLine& command) {
    if (bed_.probes(command)) return probe();
    bed_.run(command, modes_.unit_mm);
    if (command.letter == 'G') return run_g(command);
    if (command.letter == 'M') run_m(command);
    objects_.run(command);
    compensation_.run(command);
    if (command.word == "SET_GCODE_OFFSET") shift(command);
    if (command.word == "SAVE_GCODE_STATE") {
        const std::string name{command.word_name("NAME", {"MOVE", "MOVE_SPEED"}).value_or("default")};
        saved_[name] = {modes_,        offsets_, program_, retraction_.lifted_mm, filament_.programmed,
                        filament_.flow};
    }
    if (command.word == "RESTORE_GCODE_STATE") restore(command);
}

void AskedPath::run_g(const CommandLine& command) {
    if (command.number == 92 && command.subcode == 1) {
        // The machine's own coordinates again.
        for (std::size_t axis = 0; axis < kSlideCount; ++axis) offsets_.total[axis] = -offsets_.home[axis];
        offsets_.total[2] += retraction_.lifted_mm;
    }
    if (command.subcode != 0) return;
    switch (command.number) {
        case 0:
        case 1:
            return move(target(command));
        case 2:
        case 3:
        case 5:
            return begin_curve(command);
        case 10:
            // With a tool's number it sets that tool's temperatures (RepRapFirmware).
            if (!command.has('P')) draw_back();
            return;
        case 11:
            return push_again();
        case 17:
        case 18:
        case 19:
            modes_.plane = command.number == 17 ? Plane::xy : command.number == 18 ? Plane::zx : Plane::yz;
            return;
        case 20:
        case 21:
            modes_.unit_mm = command.number == 20 ? kInchMm : 1;
            return;
        case 28:
            return home(command);
        case 90:
        case 91:
            modes_.relative = command.number == 91;
            modes_.axes_rule_e = true;
            return;
        case 92:
            return rename(command);
        default:
            return;
    }
}

void AskedPath::run_m(const CommandLine& command) {
    switch (command.number) {
        case 2:
        case 30:
            // With a name M30 deletes a file.
            end_.over = end_.over || command.number == 2 || (command.present == 0 && command.tail.empty());
            return;
        case 18:
        case 84:
            if (!command.has('S')) forget_places(command);
            return;
        case 82:
        case 83:
            modes_.relative_e = command.number == 83;
            modes_.axes_rule_e = false;
            return;
        case 92:
            if (command.value('E') > 0 && command.value('T') == 0)
                filament_.scale = command.value('E') / filament_.steps_per_mm;
            return;
        case 200:
            return filament_.run_m200(command, modes_.unit_mm);
        case 206:
            for (std::size_t axis = 0; axis < kSlideCount; ++axis)
                if (command.has(kAxisLetter[axis]))
                    set_home_offset(axis, command.value(kAxisLetter[axis]) * modes_.unit_mm);
            return;
        case 207:
            read_mm(command, 'S', modes_.unit_mm, retraction_.length_mm);
            read_mm(command, 'Z', modes_.unit_mm, retraction_.lift_mm);
            return;
        case 208:
            return read_mm(command, 'S', modes_.unit_mm, retraction_.extra_mm);
        case 221:
            return change_flow(command);
        case 428:
            return centre_home();
        default:
            return;
    }
}

// ---- what is typed beside the job ---------------------------------------------------------------

std::optional<AskedPath::Stretch> AskedPath::insert(std::uint64_t behind, std::string_view line,
                                                    double left_mm) {
    lines_.insert(behind, line, left_mm);
    typed_.stretched.reset();
    run_typed();
    return std::exchange(typed_.stretched, std::nullopt);
}

/// Before more of the file is read: what is still to be given out of its line may be changed.
void AskedPath::run_typed() {
    if (curve_.active() || end_.over) return;
    note_line_end();
    while (const std::optional<CommandLine> typed = lines_.take_typed()) run(*typed);
}

void AskedPath::note_line_end() {
    if (typed_.line_ends.empty() || typed_.line_ends.back().line != lines_.number())
        typed_.line_ends.push_back({});
    typed_.line_ends.back() = {lines_.number(), machine_[kExtruder]};
    if (typed_.line_ends.size() > kLineEnds) typed_.line_ends.pop_front();
}

void AskedPath::change_flow(const CommandLine& command) {
    if (!command.has('S') || command.value('T') != 0 || command.value('D') != 0) return;
    const double before = std::exchange(filament_.flow, command.value('S') / 100.0);
    if (!command.typed || before <= 0 || before == filament_.flow || waiting_.active) return;
    const auto then = std::find_if(typed_.line_ends.rbegin(), typed_.line_ends.rend(),
                                   [&](const LineEnd& end) { return end.line <= command.typed->behind; });
    if (then == typed_.line_ends.rend()) return;
    const double left_mm = command.typed->left_mm;
    stretch({command.typed->behind, then->e_mm - left_mm, left_mm, filament_.flow / before});
}

/// Stretches what has been read. What is left of the line is the end of it, whatever it is made of.
void AskedPath::stretch(Stretch by) {
    const double extra_mm = by.moved(machine_[kExtruder]) - machine_[kExtruder];
    machine_[kExtruder] += extra_mm;
    filament_.net_mm += extra_mm;
    filament_.pushed_mm += extra_mm;
    for (LineEnd& end : typed_.line_ends)
        if (end.line >= by.line) end.e_mm = by.moved(end.e_mm);
    for (std::size_t i = given_.size(); i-- > 0;) {
        const Position from = i > 0 ? given_[i - 1].to : out_;
        AskedItem& item = given_[i];
        const double way_mm = item.to[kExtruder] - from[kExtruder];
        const bool behind = item.line > by.line;
        if (!behind && by.left_mm == 0) return;
        const double share = behind || way_mm == 0 ? 0 : 1 - by.left_mm / way_mm;
        if (share > 0 && share < 1) {
            AskedItem first = item;
            for (std::size_t axis = 0; axis < kAxisCount; ++axis)
                first.to[axis] = from[axis] + share * (item.to[axis] - from[axis]);
            item.to[kExtruder] = by.moved(item.to[kExtruder]);
            given_.insert(given_.begin() + static_cast<std::ptrdiff_t>(i), first);
            return;
        }
        item.to[kExtruder] = by.moved(item.to[kExtruder]);
        if (!behind) by.left_mm -= way_mm;
    }
    typed_.stretched = by;
}

// ---- filament -----------------------------------------------------------------------------------

/// The numbers of E are added to where it is.
bool AskedPath::Modes::e_counts_on(Flavour flavour) const {
    switch (flavour) {
        case Flavour::marlin:
            return axes_rule_e ? relative : relative_e;
        case Flavour::reprap:
        case Flavour::klipper:
            break;
    }
    return relative_e || relative;
}

/// Millimetres of filament, as this machine counts them, for one of a word's.
double AskedPath::Filament::mm_per_word() const {
    const double area_mm2 = std::numbers::pi / 4 * diameter_mm * diameter_mm;
    return flow * scale / (volumetric ? area_mm2 : 1.0);
}

void AskedPath::Filament::run_m200(const CommandLine& command, double unit_mm) {
    if (command.value('T') != 0) return;  // of a tool that is not there
    if (command.has('D')) {
        const double given_mm = command.value('D') * unit_mm;
        volumetric = given_mm > 0;
        if (volumetric) diameter_mm = given_mm;
    }
    if (command.has('S')) volumetric = command.value('S') != 0;
}

void AskedPath::draw_back() {
    Retraction& r = retraction_;
    if (r.drawn) return;
    r.drawn = true;
    r.drawn_mm = r.length_mm * filament_.scale;
    r.lifted_mm = r.lift_mm;
    Position to = program_;
    to[kExtruder] -= r.drawn_mm;
    follow_retraction(to);
    to[2] += r.lifted_mm;
    offsets_.total[2] += r.lifted_mm;
    follow_retraction(to);
}

void AskedPath::push_again() {
    Retraction& r = retraction_;
    if (!r.drawn) return;
    Position to = program_;
    to[2] -= r.lifted_mm;
    offsets_.total[2] -= r.lifted_mm;
    follow_retraction(to);
    to[kExtruder] += r.drawn_mm + r.extra_mm * filament_.scale;
    follow_retraction(to);
    r.drawn = false;
    r.drawn_mm = r.lifted_mm = 0;
}

// ---- moves --------------------------------------------------------------------------------------

Position AskedPath::target(const CommandLine& command) {
    Position to = program_;
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
        const char letter = kAxisLetter[axis];
        if (!command.has(letter)) continue;
        const double word = command.value(letter) * modes_.unit_mm;
        to[axis] = modes_.relative ? program_[axis] + word : word + offsets_.total[axis];
    }
    if (command.has('E')) {
        const double word = command.value('E') * filament_.unit(modes_.unit_mm);
        const double delta =
            modes_.e_counts_on(flavour_.value_or(lines_.flavour())) ? word : word - filament_.programmed;
        filament_.programmed += delta;
        to[kExtruder] += delta * filament_.mm_per_word();
    }
    return to;
}

void AskedPath::move(const Position& to) {
    if (to[0] != program_[0] || to[1] != program_[1]) rejoin(to);
    follow(to);
}

void AskedPath::begin_curve(const CommandLine& command) {
    const Position to = target(command);
    rejoin(program_);
    if (command.number == 5) {
        curve_.begin_spline(command, modes_.unit_mm, program_, to);
    } else {
        curve_.begin_arc(command, modes_.plane, modes_.unit_mm, program_, to);
    }
}

/// A move of an object that is left out makes the head wait; a line that moves nothing does not:
/// nothing is left out of the part, and no place has to be found again.
void AskedPath::begin_waiting(const Position& to) {
    if (waiting_.active || !objects_.skipping() || to == program_) return;
    waiting_.active = true;
    waiting_.drawn_mm = filament_.peak_mm - program_[kExtruder];
}

/// The program goes to `to`, and the machine with it, unless an object is left out.
void AskedPath::follow(const Position& to, bool curved) {
    begin_waiting(to);
    if (!waiting_.active) {
        Position there = to;
        there[kExtruder] = machine_[kExtruder] + (to[kExtruder] - program_[kExtruder]);
        give(there, curved);
    }
    const bool moves = to != program_;
    program_ = to;
    filament_.peak_mm = std::max(filament_.peak_mm, to[kExtruder]);
    if (!waiting_.active || objects_.skipping() || !moves) return;
    draw_owed();
    rise(to[2]);
}

/// A firmware's retraction is made even where the head waits.
void AskedPath::follow_retraction(const Position& to) {
    begin_waiting(to);
    if (!waiting_.active) return follow(to);
    Position there = machine_;
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) there[axis] += to[axis] - program_[axis];
    waiting_.drawn_mm -= there[kExtruder] - machine_[kExtruder];
    give(there, false);
    program_ = to;
    filament_.peak_mm = std::max(filament_.peak_mm, to[kExtruder]);
}

/// Filament to be pushed, or drawn back, until it is where the program takes it to be.
double AskedPath::owed_mm() const { return waiting_.drawn_mm - (filament_.peak_mm - program_[kExtruder]); }

/// Moves filament where the head waits.
void AskedPath::bring(double filament_mm) {
    if (filament_mm == 0) return;
    Position at = machine_;
    at[kExtruder] += filament_mm;
    waiting_.drawn_mm -= filament_mm;
    give(at, false);
}

void AskedPath::draw_owed() { bring(std::min(owed_mm(), 0.0)); }

void AskedPath::rise(double z_mm) {
    Position at = machine_;
    at[2] = std::max(at[2], z_mm);
    give(at, false);
}

/// The head is about to be taken elsewhere, or left alone.
void AskedPath::leave_part() {
    if (!waiting_.active) return;
    draw_owed();
    rise(program_[2]);
    bring(owed_mm());
}

/// The program goes on from where the head is.
void AskedPath::stop_waiting() {
    if (!waiting_.active) return;
    waiting_.active = false;
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) program_[axis] = machine_[axis];
}

/// Brings a machine that waited to `to`, the place of the next move that goes sideways.
void AskedPath::rejoin(const Position& to) {
    if (!waiting_.active || objects_.skipping()) return;
    draw_owed();
    rise(to[2]);
    Position at = machine_;
    at[0] = to[0];
    at[1] = to[1];
    give(at, false);
    at[2] = to[2];
    give(at, false);
    bring(owed_mm());
    stop_waiting();
}

void AskedPath::give(const Position& to, bool curved) {
    const double filament = to[kExtruder] - machine_[kExtruder];
    filament_.net_mm += filament;
    filament_.pushed_mm += std::max(filament, 0.0);
    if (to == machine_) return;
    machine_ = to;
    given_.push_back(
        {AskedItem::Kind::move, 0, curved, lines_.number(), to, compensation_.advance_s(), bed_.now()});
}

// ---- coordinates --------------------------------------------------------------------------------

/// Motors go off: slides that they move are no longer where they were found.
void AskedPath::forget_places(const CommandLine& command) {
    const std::uint8_t named = named_slides(command);
    const bool all = named == 0 && !command.has('E');
    const std::uint8_t off = gantry_.motors_of(all ? 0b111 : named);
    if (off != 0) leave_part();
    for (unsigned slide = 0; slide < kSlideCount; ++slide) {
        const auto bit = static_cast<std::uint8_t>(1u << slide);
        if ((gantry_.motors_of(bit) & off) != 0)
            known_.homed = static_cast<std::uint8_t>(known_.homed & ~bit);
    }
}

void AskedPath::home(const CommandLine& command) {
    if (command.has('O') && known_.homed == 0b111) return;
    std::uint8_t mask = named_slides(command);
    // Axes that other machines have: nothing of this one is meant.
    if (mask == 0 &&
        (command.has('U') || command.has('V') || command.has('A') || command.has('B') || command.has('C')))
        return;
    // A delta's carriages find the nozzle together.
    if (mask == 0 || !gantry_.is_linear()) mask = 0b111;
    leave_part();
    known_.homed = static_cast<std::uint8_t>(known_.homed | mask);
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
        if ((mask >> axis & 1u) == 0) continue;
        machine_[axis] = program_[axis] = known_.home_mm[axis];
        offsets_.total[axis] = offsets_.code[axis] - offsets_.home[axis];
        if (axis == 2) retraction_.lifted_mm = 0;
    }
    bool there = true;
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) there = there && program_[axis] == machine_[axis];
    if (there) stop_waiting();
    if ((mask >> 2 & 1u) != 0) bed_.lose_place();
    given_.push_back({AskedItem::Kind::home, mask, false, lines_.number(), machine_, 0, bed_.now()});
}

void AskedPath::probe() {
    leave_part();
    stop_waiting();
    for (std::size_t axis = 0; axis < kSlideCount; ++axis)
        machine_[axis] = program_[axis] = known_.probed_at[axis];
    bed_.lose_place();
    static_cast<void>(bed_.measured());
    given_.push_back({AskedItem::Kind::probe, 0, false, lines_.number(), machine_, 0, bed_.now()});
}

void AskedPath::rename(const CommandLine& command) {
    const bool all = command.present == 0;  // without a letter: every axis, to 0
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
        const char letter = kAxisLetter[axis];
        if (all || command.has(letter))
            offsets_.total[axis] = program_[axis] - command.value(letter) * modes_.unit_mm;
    }
    if (all || command.has('E')) filament_.programmed = command.value('E') * filament_.unit(modes_.unit_mm);
}

void AskedPath::set_home_offset(std::size_t axis, double mm) {
    offsets_.total[axis] += offsets_.home[axis] - mm;
    offsets_.home[axis] = mm;
}

/// M428: the place where the machine stands is the switch's, provided that it is near it.
void AskedPath::centre_home() {
    Slides off{};
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
        off[axis] = known_.home_mm[axis] - program_[axis];
        if (std::abs(off[axis]) > kReferenceMm) return;
    }
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) set_home_offset(axis, off[axis]);
}

/// RESTORE_GCODE_STATE: what numbers mean is as it was; MOVE=1 also goes back.
void AskedPath::restore(const CommandLine& command) {
    const auto found =
        saved_.find(std::string{command.word_name("NAME", {"MOVE", "MOVE_SPEED"}).value_or("default")});
    if (found == saved_.end()) return;
    const Saved& then = found->second;
    modes_.relative = then.modes.relative;
    modes_.relative_e = then.modes.relative_e;
    modes_.axes_rule_e = then.modes.axes_rule_e;
    offsets_ = then.offsets;
    offsets_.total[2] += retraction_.lifted_mm - then.lifted_mm;
    filament_.programmed = then.programmed_e;
    filament_.flow = then.flow;
    if (command.word_number("MOVE").value_or(0) == 0) return;
    Position to = then.program;
    to[kExtruder] = program_[kExtruder];
    move(to);
}

/// SET_GCODE_OFFSET X= Y= Z= E=, or X_ADJUST= …: the coordinates shift by so much. MOVE=1 goes
/// along.
void AskedPath::shift(const CommandLine& command) {
    constexpr std::array<const char*, kAxisCount> kAdjust{"X_ADJUST", "Y_ADJUST", "Z_ADJUST", "E_ADJUST"};
    Position to = program_;
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
        const std::optional<double> given = command.word_number({&kAxisLetter[axis], 1});
        const std::optional<double> more = command.word_number(kAdjust[axis]);
        if (!given && !more) continue;
        const double asked = given ? *given : offsets_.code[axis] + *more;
        const double change = asked - offsets_.code[axis];
        offsets_.code[axis] = asked;
        if (axis == kExtruder) {
            filament_.programmed -= change;
        } else {
            offsets_.total[axis] += change;
            to[axis] += change;
        }
    }
    if (command.word_number("MOVE").value_or(0) != 0) move(to);
}

}  // namespace qduino::twin
