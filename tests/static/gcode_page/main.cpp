// Prints docs/gcode.md from the printer's own table of G-codes.
//
//   gcode-page > docs/gcode.md        after a change of printer/gcode/command_table.cpp
//   gcode-page --check docs/gcode.md  names the first line that differs, and ends with 1 (./test)
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>
#include <string_view>

#include "printer/gcode/command_table.h"

namespace {

using namespace qduino::printer::gcode;

constexpr std::string_view kHead = R"(# G-codes

Printed from `printer/gcode/command_table.cpp` by `gcode-page`; `./test` compares. How to add one:
[adding.md](adding.md).

The dialect is Marlin's as slicers and hosts emit it, with Klipper's words where slicers write them.
Letters that are not listed are ignored, or, where the row says *only*, refused.

A G-code or a word that is not on this page may stand for motion, and so may a line that begins with
a coordinate: it refuses the job before anything is heated, with its line. (Words can be given a
meaning: `[macros]` in the [machine file](machine.md#macros).) Any other unknown code is answered
and skipped.

A number may have an exponent (`F1.2e+3`, `E8.5e-05`): an `E` behind a digit, with digits behind it,
is one. Only where words stand without blanks (`G1X60Y40E1`) is it the extruder's word, and there,
too, `e+3` and `e-05` are exponents. Parentheses hold comments, as in RS274.

- A job must home each axis before it moves it, and wait for the hot end before it moves filament.
  Else it is refused. An axis whose motors went off (`M84`) has to be homed again.
- A move that a person types is refused like a jog: `home first`, before its axes have been homed. A
  serial host's is made, with a remark.
- `M109` and `M190` without a temperature wait for the target in force.
- `F600` alone is the speed of the moves that follow. `S` alone is the speed of a spindle, and
  nothing here.
- `M2` and `M30` end the program: what stands behind is not carried out, which is remarked. `M30`
  with a name is Marlin's: delete that file.
- A display fails no job: what makes no sense in `M73`, and what is too long in `M117`, is not
  shown.
- Tools other than T0 may be switched off (`M104 S0 T1`), and not on. `G28 X U` homes X; `G28 U`
  alone homes nothing here.
- `G90` and `G91` set E's mode as well, as in Marlin 2. In a file of Klipper's, RepRapFirmware's or
  a Prusa MK3's they leave it as `M82` or `M83` said, and E counts on while `G91` holds. A file is
  Klipper's from its first word on (`SET_VELOCITY_LIMIT`, `EXCLUDE_OBJECT`, a macro) or from a
  slicer's `; gcode_flavor = klipper`; RepRapFirmware's from an `M572`, `M566`, `M568`, `G10 P` or
  `;FLAVOR:RepRap`; an MK3's from its `M862.3`. What it means is remarked where it matters, and a
  sign that comes after an E that it would have changed refuses the job. `dialect` in the [machine
  file](machine.md) says it for every job.
- `G28 O` homes nothing once the job itself has homed X, Y and Z, and they have not been let go
  since (`M84`).
- `G92` without axes calls the present place 0 on all of them, and `G92 E` is `G92 E0`, as in
  Klipper and Marlin 1. (Marlin 2 passes both over.)
- Arcs and splines become chords within 0.005 mm of the true curve. An arc with I, J or K whose ends
  are within 0.0005 mm is a whole circle.
- `M92` calibrates E by up to 25 %; X, Y and Z must be what the machine file says.
- An object that is left out (`M486 P`, `EXCLUDE_OBJECT`, in the job or typed beside it) moves
  nothing: the head waits where it was until a line behind the object goes sideways, and then goes
  up, sideways and down to that place. What has been read already is still printed: two seconds of
  it, or the line in hand. Behind the object a retraction and a way up are carried out at once, a
  way down only at the program's place. Before a homing, `M84` and the end of the job the head goes
  up as far as the program is. At most 1,024 objects, whose names are the same in any case, and told
  apart by all of their bytes: bare, with blanks, or in quotes; a line that is longer than 256 bytes
  is refused. The twin is told of what was typed. What stands behind the A of `M486` is a name: its
  letters are no parameters.
- `M900 K30`: a K above 10 is a factor of Linear Advance 1.0, which Prusa's profiles write beside
  the other. It changes nothing.
- `M0`, `M1`, `M25`, `M125`, `M600`, `M601` and `PAUSE` park the head beside the part and wait; the
  job goes on at the very step. `M600` also draws the filament out there, and pushes the new one in
  with a purge (`[park]` in the [machine file](machine.md)).
- `M302 S160` is the least temperature at which filament moves, for its job: never below the machine
  file's `minimum_extrude_floor_celsius`, which `M302 P1` asks for. A wait is content a little below
  its target (`at_target_celsius`), so filament moves as little below the limit.
- A job leaves nothing to the next one: limits, accelerations, pressure advance, shapers, skew, fade
  and the heaters' numbers go back to what they were before it. What a person types between jobs
  stays, and `M500` keeps the heaters' numbers and the beds. The bed that was measured last stays
  known.
- `TEMPERATURE_WAIT` waits between `MINIMUM` and `MAXIMUM`. Where the target does not lead there, it
  is an error: Klipper would wait for ever.
- `SAVE_GCODE_STATE` keeps up to four states, for this job: modes, coordinates, speed, factors and
  the place. `RESTORE_GCODE_STATE MOVE=1` also goes back there.
- `M220`, `M221`, a pause and a cancel that are typed take hold within two seconds of printing, also
  in a long line.
- `M84` waits for the motion before it, and the lines behind it wait for `M84`; a move switches its
  motors on again. `M84 S60`: motors that nobody has moved for 60 s go off, while no job runs.

*When it may be typed* (or sent by a host beside the job): **at rest** while no job runs; **paused**
also while a job is paused and the head waits beside the part; **printing** also while a job
runs; **always** also while a fault is latched.

## Carried out

| code | what it does | letters | may be typed |
|---|---|---|---|
)";

constexpr std::string_view kRefused = R"(
## Known, and refused

They would change the part, and this printer does not do them: a job that holds one is refused
before anything is heated.

| code | what it would do |
|---|---|
)";

constexpr std::string_view kSkipped = R"(
## Known, and skipped

A job goes on without them, and its first line of each is remarked. Either they change no part
(lights, messages, reports), or what they would set is the machine file's here (skew, backlash,
currents, the probe's offset), or this machine has nothing for them to work on (a chamber, two Z
motors to level).

| code | what it would do |
|---|---|
)";

std::string name_of(const Code& code) {
    if (code.letter == '\0') return std::string{code.word};
    std::string name = code.letter + std::to_string(code.number);
    if (code.letter == 'T') return name + " …";
    if (code.letter == 'F' || code.letter == 'S') return std::string{code.letter} + " alone";
    if (code.subcode == Code::kAnySubcode) return name + ".*";
    return code.subcode == Code::kNoSubcode ? name : name + "." + std::to_string(code.subcode);
}

std::string letters_of(const CodeInfo& info) {
    if (info.tail == Tail::free_text) return "a text";
    if (info.code.letter == '\0') return "KEY=VALUE";
    std::string letters;
    for (const char letter : info.parameters)
        letters += (letters.empty() ? "" : " ") + std::string(1, letter);
    if (info.strictness == Strictness::lenient) return letters;
    return letters.empty() ? "none" : letters + " only";
}

std::string_view word_of(Typed typed) {
    switch (typed) {
        case Typed::at_rest:
            return "at rest";
        case Typed::parked:
            return "paused";
        case Typed::printing:
            return "printing";
        case Typed::always:
            return "always";
    }
    return {};
}

std::string page() {
    std::ostringstream out;
    out << kHead;
    for (const CodeInfo& info : known_codes()) {
        if (info.handler == nullptr || is_refused(info)) continue;
        out << "| " << name_of(info.code) << " | " << info.name << " | " << letters_of(info) << " | "
            << word_of(info.typed) << " |\n";
    }
    out << kRefused;
    for (const CodeInfo& info : known_codes()) {
        if (is_refused(info)) out << "| " << name_of(info.code) << " | " << info.name << " |\n";
    }
    out << kSkipped;
    for (const CodeInfo& info : known_codes()) {
        if (info.handler == nullptr) out << "| " << name_of(info.code) << " | " << info.name << " |\n";
    }
    return out.str();
}

/// 0 when `path` holds the page.
int check(const char* path) {
    std::ifstream file{path};
    std::istringstream wanted{page()};
    for (int number = 1;; ++number) {
        std::string is;
        std::string should_be;
        const bool more = static_cast<bool>(std::getline(file, is));
        const bool more_wanted = static_cast<bool>(std::getline(wanted, should_be));
        if (!more && !more_wanted) return 0;
        if (more == more_wanted && is == should_be) continue;
        std::cerr << path << ":" << number << ": is        " << is << "\n"
                  << path << ":" << number << ": should be " << should_be << "\n"
                  << "print it anew: build/release/bin/gcode-page > docs/gcode.md\n";
        return 1;
    }
}

}  // namespace

int main(int count, char** arguments) {
    if (count == 3 && std::string_view{arguments[1]} == "--check") return check(arguments[2]);
    if (count != 1) {
        std::cerr << "usage: gcode-page [--check FILE]\n";
        return 2;
    }
    std::cout << page();
    return 0;
}
