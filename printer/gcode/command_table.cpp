#include "printer/gcode/command_table.h"

#include <algorithm>
#include <functional>

namespace qduino::printer::gcode {

// The bodies. A new code is its name here, its row below, and its body in one of these files.
namespace handlers {
/// It cannot fail.
using SureHandler = void(Context& context, const Command& command);
// handlers_motion.cpp
Handler linear_move, arc_clockwise, arc_counterclockwise, dwell, wait_for_moves, retract, recover, home, tool;
// handlers_state.cpp
Handler set_position, retraction_settings, recover_settings, speed_factor, flow_factor;
SureHandler inches, millimetres, absolute, relative, absolute_extrusion, relative_extrusion,
    machine_coordinates, nothing;
// handlers_machine.cpp
Handler hot_end, hot_end_wait, bed, bed_wait, fan_on, fan_off, motors_off, axis_accelerations, axis_speeds,
    accelerations, instantaneous_speeds, progress, stop, pause, filament_change;
SureHandler message, echo, report_temperatures, report_position, report_firmware, cold_extrusion,
    emergency_stop;
}  // namespace handlers

namespace {

using namespace handlers;
using enum Strictness;
using enum Typed;
using enum Tail;

template <handlers::SureHandler* act>
Result<void> sure(Context& context, const Command& command) {
    act(context, command);
    return {};
}

constexpr CodeInfo kCodes[]{
    {{"EXCLUDE_OBJECT"}, "leave an object out", ""},
    {{"EXCLUDE_OBJECT_DEFINE"}, "name an object", ""},
    {{"EXCLUDE_OBJECT_END"}, "an object ends", ""},
    {{"EXCLUDE_OBJECT_START"}, "an object begins", ""},
    {{'G', 0}, "travel move", "XYZEF", linear_move, strict, parked},
    {{'G', 1}, "linear move", "XYZEF", linear_move, strict, parked},
    {{'G', 2}, "arc, clockwise", "XYZEFIJRP", arc_clockwise, strict},
    {{'G', 3}, "arc, counterclockwise", "XYZEFIJRP", arc_counterclockwise, strict},
    {{'G', 4}, "dwell", "SP", dwell},
    {{'G', 10}, "retract", "S", retract, strict},
    {{'G', 11}, "recover from retraction", "", recover, strict},
    {{'G', 12}, "clean the nozzle", "PRSTXYZ"},
    {{'G', 17}, "XY plane", "", sure<nothing>},
    {{'G', 20}, "inches", "", sure<inches>},
    {{'G', 21}, "millimetres", "", sure<millimetres>},
    {{'G', 26}, "mesh validation pattern", "BCDFHIKLOPQRSUXY"},
    {{'G', 27}, "park", "P"},
    {{'G', 28}, "home", "XYZORLW", home, strict},
    {{'G', 29}, "probe the bed mesh", "ABCDEFHIJKLOPQRSTUVWXYZ"},
    {{'G', 30}, "probe one point", "CXY"},
    {{'G', 34}, "align Z", ""},
    {{'G', 80}, "bed mesh on", ""},
    {{'G', 90}, "absolute coordinates", "", sure<absolute>, parked},
    {{'G', 91}, "relative coordinates", "", sure<relative>, parked},
    {{'G', 92}, "set position", "XYZE", set_position, strict},
    {{'G', 92, 1}, "machine coordinates", "", sure<machine_coordinates>, strict},
    {{'M', 0}, "stop and wait", "", stop, free_text},
    {{'M', 1}, "stop and wait", "", stop, free_text},
    {{'M', 17}, "motors on", "XYZE"},
    {{'M', 18}, "motors off", "SXYZE", motors_off},
    {{'M', 20}, "list files", "FLT"},
    {{'M', 21}, "card begins", ""},
    {{'M', 22}, "card ends", ""},
    {{'M', 23}, "select file", "", nullptr, free_text},
    {{'M', 24}, "start file", "ST"},
    {{'M', 25}, "pause file", ""},
    {{'M', 27}, "file progress", "CS"},
    {{'M', 28}, "write file", "", nullptr, free_text},
    {{'M', 29}, "end of written file", ""},
    {{'M', 30}, "delete file", "", nullptr, free_text},
    {{'M', 31}, "print time", ""},
    {{'M', 42}, "switch a pin", "IPST"},
    {{'M', 73}, "progress", "PRQS", progress, always},
    {{'M', 74}, "print weight", "W"},
    {{'M', 75}, "print timer on", ""},
    {{'M', 76}, "print timer pause", ""},
    {{'M', 77}, "print timer off", ""},
    {{'M', 82}, "absolute extrusion", "", sure<absolute_extrusion>, parked},
    {{'M', 83}, "relative extrusion", "", sure<relative_extrusion>, parked},
    {{'M', 84}, "motors off", "SXYZE", motors_off},
    {{'M', 85}, "inactivity shutdown", "S"},
    {{'M', 92}, "steps per millimetre", "XYZE"},
    {{'M', 104}, "hot end temperature", "STRIBF", hot_end, printing},
    {{'M', 105}, "report temperatures", "T", sure<report_temperatures>, always},
    {{'M', 106}, "fan on", "SP", fan_on, printing},
    {{'M', 107}, "fan off", "P", fan_off, printing},
    {{'M', 108}, "end a wait", ""},
    {{'M', 109}, "hot end temperature, and wait", "SRTIBF", hot_end_wait},
    {{'M', 110}, "line number", "N", sure<nothing>},  // host_session.h takes it
    {{'M', 111}, "debug level", "S"},
    {{'M', 112}, "emergency stop", "", sure<emergency_stop>, always},
    {{'M', 113}, "host keepalive", "S"},
    {{'M', 114}, "report position", "DER", sure<report_position>, always},
    {{'M', 115}, "report firmware", "", sure<report_firmware>, always, free_text},
    {{'M', 117}, "message", "", sure<message>, always, free_text},
    {{'M', 118}, "echo", "", sure<echo>, free_text},
    {{'M', 119}, "report endstops", ""},
    {{'M', 140}, "bed temperature", "SI", bed, printing},
    {{'M', 141}, "chamber temperature", "S"},
    {{'M', 145}, "material preset", "BFHS"},
    {{'M', 149}, "temperature units", "CFK"},
    {{'M', 150}, "lights", "BIKPRSUW"},
    {{'M', 155}, "report temperatures by itself", "S"},
    {{'M', 190}, "bed temperature, and wait", "SRI", bed_wait},
    {{'M', 191}, "chamber temperature, and wait", "SR"},
    {{'M', 200}, "volumetric extrusion", "DLST"},
    {{'M', 201}, "largest accelerations", "XYZEFSTP", axis_accelerations},
    {{'M', 203}, "largest speeds", "XYZETP", axis_speeds},
    {{'M', 204}, "accelerations", "PRTS", accelerations},
    {{'M', 205}, "instantaneous speeds", "XYZEJSTB", instantaneous_speeds},
    {{'M', 206}, "home offset", "PTXYZ"},
    {{'M', 207}, "retraction", "SFZW", retraction_settings},
    {{'M', 208}, "recovery", "SFWR", recover_settings},
    {{'M', 209}, "automatic retraction", "S"},
    {{'M', 211}, "software endstops", "S"},
    {{'M', 220}, "speed factor", "SBR", speed_factor, printing},
    {{'M', 221}, "flow factor", "ST", flow_factor, printing},
    {{'M', 300}, "beep", "PS"},
    {{'M', 301}, "hot end PID", "CDEFILP"},
    {{'M', 302}, "report cold extrusion", "PS", sure<cold_extrusion>, always},
    {{'M', 303}, "tune PID", "CDESU"},
    {{'M', 304}, "bed PID", "DIP"},
    {{'M', 355}, "case light", "PS"},
    {{'M', 400}, "wait for the moves", "", wait_for_moves},
    {{'M', 410}, "stop the moves", ""},
    {{'M', 412}, "filament sensor", "DHRS"},
    {{'M', 413}, "power loss recovery", "S"},
    {{'M', 420}, "bed mesh", "CLSTVZ"},
    {{'M', 425}, "backlash", "FSXYZ"},
    {{'M', 486}, "object labels", "ACPSTU"},
    {{'M', 500}, "save settings", ""},
    {{'M', 501}, "load settings", ""},
    {{'M', 502}, "factory settings", ""},
    {{'M', 503}, "report settings", "CS"},
    {{'M', 540}, "stop at endstop", "S"},
    {{'M', 555}, "print area", "XYWH"},
    {{'M', 566}, "allowed speed changes", "XYZEP"},
    {{'M', 569}, "stepper driver", "EISTXYZ"},
    {{'M', 572}, "pressure advance", "DSW"},
    {{'M', 593}, "input shaping", "DFPXY"},
    {{'M', 600}, "filament change", "BELTUXYZR", filament_change},
    {{'M', 601}, "pause", "", pause},
    {{'M', 602}, "resume", ""},
    {{'M', 603}, "filament change lengths", "LTU"},
    {{'M', 701}, "load filament", "LPTZ"},
    {{'M', 702}, "unload filament", "PTUZ"},
    {{'M', 851}, "probe offset", "XYZ"},
    {{'M', 862, Code::kAnySubcode}, "printer check", "PQTU"},
    {{'M', 862}, "printer check", ""},
    {{'M', 900}, "pressure advance", "KLST"},
    {{'M', 906}, "motor current", "EITXYZ"},
    {{'M', 907}, "motor current", "BCDESXYZ"},
    {{'M', 914}, "sensorless homing", "IXYZ"},
    {{'T', 0}, "tool", "", tool},
};

constexpr bool is_sorted_and_unique() {
    return std::ranges::adjacent_find(kCodes, std::ranges::greater_equal{}, &CodeInfo::code) ==
           std::ranges::end(kCodes);
}
static_assert(is_sorted_and_unique(), "a row stands at the wrong place, or twice");

const CodeInfo* find_row(const Code& code) {
    const CodeInfo* const row = std::ranges::lower_bound(kCodes, code, {}, &CodeInfo::code);
    return row != std::ranges::end(kCodes) && row->code == code ? row : nullptr;
}

/// The row without a subcode; all tools are one family.
const CodeInfo* find_family(char letter, std::uint32_t number) {
    return find_row({letter, letter == 'T' ? 0 : number});
}

}  // namespace

std::span<const CodeInfo> known_codes() { return kCodes; }

const CodeInfo* find_code(const Command& command) {
    if (command.letter == '\0') return find_row(Code{command.word.view()});
    // T0 … T99 are known; the handler decides which of them exist.
    const std::uint32_t number = command.letter == 'T' && command.number < 100 ? 0 : command.number;
    if (!command.subcode) return find_row({command.letter, number});
    const CodeInfo* const exact = find_row({command.letter, number, *command.subcode});
    return exact != nullptr ? exact : find_row({command.letter, number, Code::kAnySubcode});
}

bool takes_free_text(char letter, std::uint32_t number) {
    const CodeInfo* const code = find_family(letter, number);
    return code != nullptr && code->tail == free_text;
}

bool must_be_words(char letter, std::uint32_t number) {
    const CodeInfo* const code = find_family(letter, number);
    return code != nullptr && code->tail == words && code->handler != nullptr;
}

Typed may_be_typed(char letter, std::uint32_t number) {
    const CodeInfo* const code = find_family(letter, number);
    return code != nullptr ? code->typed : at_rest;
}

}  // namespace qduino::printer::gcode
