#include "printer/gcode/command_table.h"

#include <algorithm>
#include <functional>

#include "printer/gcode/text.h"

namespace qduino::printer::gcode {

// The bodies. A new code is its name here, its row below, and its body in one of these files.
namespace handlers {
/// It cannot fail.
using SureHandler = void(Context& context, const Command& command);
// handlers_motion.cpp
Handler linear_move, arc_clockwise, arc_counterclockwise, spline, dwell, wait_for_moves, retract, recover,
    home, tool, tool_change, lone_speed;
// handlers_state.cpp
Handler set_position, retraction_settings, recover_settings, speed_factor, flow_factor, volumetric,
    steps_per_mm, home_offsets, home_offsets_here;
SureHandler inches, millimetres, absolute, relative, absolute_extrusion, relative_extrusion,
    machine_coordinates, plane, nothing;
// handlers_machine.cpp
Handler hot_end, tool_temperatures, hot_end_wait, bed, bed_wait, wait_for_heat, fan_on, fan_off, motors_off,
    axis_accelerations, axis_speeds, accelerations, instantaneous_speeds, input_shaping, linear_advance,
    pressure_advance, stop, pause, park, filament_change, cold_extrusion, end_program, refused;
// handlers_heat.cpp
Handler hot_end_gains, bed_gains, tune_gains, heater_model, keep_settings, restore_settings, factory_settings;
SureHandler report_settings;
// handlers_machine.cpp, which cannot fail
SureHandler message, echo, progress, report_temperatures, report_position, report_firmware, emergency_stop;
// handlers_words.cpp, handlers_compensation.cpp
Handler heater_temperature, temperature_wait, heaters_off, save_state, restore_state, velocity_limit,
    set_input_shaper, set_pressure_advance, code_offset, choose_extruder, object_begins, object_ends,
    exclude_object, object_labels;
// handlers_bed.cpp
Handler probe_bed, follow_bed, forget_bed, bed_profile, skew, set_skew;
}  // namespace handlers

namespace {

using namespace handlers;
using enum Strictness;
using enum Typed;
using enum Tail;
using enum Ok;

template <handlers::SureHandler* act>
Result<void> sure(Context& context, const Command& command) {
    act(context, command);
    return {};
}

// M110, M113 and M155 speak to the serial host's session (serial/serial_session.h). M108 and
// M410 act when they arrive (machine/machine.cpp): in a job there is nothing for them to do.
constexpr CodeInfo kCodes[]{
    {{"ACTIVATE_EXTRUDER"}, "tool", "", choose_extruder},
    {{"BED_MESH_CALIBRATE"}, "probe the bed mesh", "", probe_bed, when_done},
    {{"BED_MESH_CLEAR"}, "bed mesh off", "", forget_bed},
    {{"BED_MESH_PROFILE"}, "bed mesh", "", bed_profile},
    {{"CLEAR_PAUSE"}, "forget a pause", ""},
    // The objects' words of SuperSlicer 2.4, before Klipper had its own (Klipper3d/klipper#5599).
    {{"DEFINE_OBJECT"}, "name an object", ""},
    {{"END_CURRENT_OBJECT"}, "an object ends", "", object_ends},
    {{"EXCLUDE_OBJECT"}, "leave an object out", "", exclude_object, printing},
    {{"EXCLUDE_OBJECT_DEFINE"}, "name an object", ""},
    {{"EXCLUDE_OBJECT_END"}, "an object ends", "", object_ends},
    {{"EXCLUDE_OBJECT_START"}, "an object begins", "", object_begins},
    {{"GET_POSITION"}, "report position", "", sure<report_position>, always, when_done},
    {{"PAUSE"}, "pause", "", pause, when_done},
    {{"QUAD_GANTRY_LEVEL"}, "align the gantry", ""},
    {{"QUERY_ENDSTOPS"}, "report endstops", ""},
    {{"RESPOND"}, "echo", ""},
    {{"RESTORE_GCODE_STATE"}, "modes and coordinates that were kept", "", restore_state},
    {{"RESUME"}, "resume", ""},
    {{"SAVE_GCODE_STATE"}, "keep modes and coordinates", "", save_state},
    {{"SAVE_VARIABLE"}, "keep a number", ""},
    {{"SET_DISPLAY_TEXT"}, "message", ""},
    {{"SET_FAN_SPEED"}, "another fan", ""},
    {{"SET_FILAMENT_SENSOR"}, "filament sensor", ""},
    {{"SET_GCODE_OFFSET"}, "shift the coordinates", "", code_offset},
    {{"SET_GCODE_VARIABLE"}, "a macro's number", ""},
    {{"SET_HEATER_TEMPERATURE"}, "temperature", "", heater_temperature},
    {{"SET_IDLE_TIMEOUT"}, "idle time-out", ""},
    {{"SET_INPUT_SHAPER"}, "input shaping", "", set_input_shaper},
    {{"SET_LED"}, "lights", ""},
    {{"SET_PIN"}, "switch a pin", ""},
    {{"SET_PRESSURE_ADVANCE"}, "pressure advance", "", set_pressure_advance},
    {{"SET_PRINT_STATS_INFO"}, "layer number", ""},
    {{"SET_SKEW"}, "skew correction", "", set_skew},
    {{"SET_VELOCITY_LIMIT"}, "largest speed and acceleration", "", velocity_limit},
    {{"SKEW_PROFILE"}, "skew correction", ""},
    {{"START_CURRENT_OBJECT"}, "an object begins", "", object_begins},
    {{"STATUS"}, "report", ""},
    {{"T?"}, "choose a tool", ""},
    {{"TC"}, "choose a tool", ""},
    {{"TEMPERATURE_WAIT"}, "wait for a temperature", "", temperature_wait, when_done},
    {{"TIMELAPSE_TAKE_FRAME"}, "take a picture", ""},
    {{"TURN_OFF_HEATERS"}, "heaters off", "", heaters_off},
    {{"TX"}, "choose a tool", ""},
    {{"UPDATE_DELAYED_GCODE"}, "a macro's timer", ""},
    {{"Z_TILT_ADJUST"}, "align Z", ""},
    {{'F', 0}, "speed of the moves that follow", "FS", lone_speed, strict, parked},
    {{'G', 0}, "travel move", "XYZEFSH", linear_move, strict, parked},
    {{'G', 1}, "linear move", "XYZEFSH", linear_move, strict, parked},
    {{'G', 2}, "arc, clockwise", "XYZEFIJKRP", arc_clockwise, strict},
    {{'G', 3}, "arc, counterclockwise", "XYZEFIJKRP", arc_counterclockwise, strict},
    {{'G', 4}, "dwell", "SP", dwell, when_still},
    {{'G', 5}, "cubic spline", "XYZEFIJPQ", spline, strict},
    {{'G', 10}, "retract; with P: a tool's temperatures", "PRSXYZ", retract, strict},
    {{'G', 11}, "recover from retraction", "S", recover, strict},
    {{'G', 12}, "clean the nozzle", "PRSTXYZ"},
    {{'G', 17}, "arcs in the XY plane", "", sure<plane>, strict},
    {{'G', 18}, "arcs in the ZX plane", "", sure<plane>, strict},
    {{'G', 19}, "arcs in the YZ plane", "", sure<plane>, strict},
    {{'G', 20}, "inches", "", sure<inches>},
    {{'G', 21}, "millimetres", "", sure<millimetres>},
    {{'G', 26}, "mesh validation pattern", "BCDFHIKLOPQRSUXY", refused},
    {{'G', 27}, "park", "P"},
    {{'G', 28}, "home; O: unless this job has", "XYZO", home, when_done},
    {{'G', 29}, "probe the bed mesh", "ABCDEFHIJKLOPQRSTUVWXYZ", probe_bed, when_done},
    {{'G', 30}, "probe one point", "CXY"},
    {{'G', 31}, "probe's trigger height", ""},
    {{'G', 32}, "level the bed", ""},
    {{'G', 33}, "calibrate a delta", ""},
    {{'G', 34}, "align Z", ""},
    {{'G', 35}, "tramming wizard", ""},
    {{'G', 40}, "cutter compensation off", "", sure<nothing>},
    {{'G', 49}, "tool length offset off", "", sure<nothing>},
    {{'G', 54}, "first work coordinates", "", sure<nothing>},
    {{'G', 80}, "probe the bed mesh", "", probe_bed, when_done},
    {{'G', 90}, "absolute coordinates", "", sure<absolute>, parked},
    {{'G', 91}, "relative coordinates", "", sure<relative>, parked},
    {{'G', 91, 1}, "arcs' centres are relative", "", sure<nothing>},
    {{'G', 92}, "set position", "XYZEABCUVW", set_position, strict},
    {{'G', 92, 1}, "machine coordinates", "", sure<machine_coordinates>, strict},
    {{'G', 94}, "speeds are per minute", "", sure<nothing>},
    // Griffin's, of Ultimaker's printers: the nozzle is full behind a start, too.
    {{'G', 280}, "prime the nozzle", "S"},
    {{'M', 0}, "stop and wait", "", stop, free_text, when_still},
    {{'M', 1}, "stop and wait", "", stop, free_text, when_still},
    {{'M', 2}, "end of the program", "", end_program, free_text},
    {{'M', 3}, "spindle or laser on", "IOS", refused},
    {{'M', 4}, "spindle or laser on", "IOS", refused},
    {{'M', 5}, "spindle or laser off", ""},
    {{'M', 6}, "tool change", "T", tool_change},
    {{'M', 17}, "motors on", "XYZE"},
    {{'M', 18}, "motors off", "SXYZE", motors_off},
    {{'M', 20}, "list files", "FLT"},
    {{'M', 21}, "card begins", ""},
    {{'M', 22}, "card ends", ""},
    {{'M', 23}, "select file", "", nullptr, free_text},
    {{'M', 24}, "start file", "ST"},
    {{'M', 25}, "pause", "", pause, when_still},
    {{'M', 27}, "file progress", "CS"},
    {{'M', 28}, "write file", "", nullptr, free_text},
    {{'M', 29}, "end of written file", ""},
    {{'M', 30}, "end of the program", "", end_program, free_text},
    {{'M', 31}, "print time", ""},
    {{'M', 32}, "print another file", "", refused},
    {{'M', 42}, "switch a pin", "IPST"},
    {{'M', 73}, "progress", "PRQS", sure<progress>, always, loose, when_done},
    {{'M', 74}, "print weight", "W"},
    {{'M', 75}, "print timer on", ""},
    {{'M', 76}, "print timer pause", ""},
    {{'M', 77}, "print timer off", ""},
    {{'M', 82}, "absolute extrusion", "", sure<absolute_extrusion>, parked},
    {{'M', 83}, "relative extrusion", "", sure<relative_extrusion>, parked},
    {{'M', 84}, "motors off", "SXYZE", motors_off},
    {{'M', 85}, "inactivity shutdown", "S"},
    {{'M', 92}, "steps per millimetre", "XYZET", steps_per_mm, strict},
    {{'M', 98}, "call another file", "", refused},
    {{'M', 101}, "extruder on", ""},
    {{'M', 102}, "extruder backward", ""},
    {{'M', 103}, "extruder off", ""},
    {{'M', 104}, "hot end temperature", "STRIBF", hot_end, printing},
    {{'M', 105}, "report temperatures", "T", sure<report_temperatures>, always, loose, when_done},
    {{'M', 106}, "fan on", "SP", fan_on, printing},
    {{'M', 107}, "fan off", "P", fan_off, printing},
    {{'M', 108}, "end a wait", "", sure<nothing>, always},
    {{'M', 109}, "hot end temperature, and wait", "SRTIBF", hot_end_wait, when_done},
    {{'M', 110}, "line number", "N", sure<nothing>},
    {{'M', 111}, "debug level", "S"},
    {{'M', 112}, "emergency stop", "", sure<emergency_stop>, always},
    {{'M', 113}, "host keepalive", "S", sure<nothing>, loose},
    {{'M', 114}, "report position", "DER", sure<report_position>, always, loose, when_done},
    {{'M', 115}, "report firmware", "", sure<report_firmware>, always, free_text, when_done},
    {{'M', 116}, "wait for the heaters", "", wait_for_heat, when_done},
    {{'M', 117}, "message", "", sure<message>, always, free_text},
    {{'M', 118}, "echo", "", sure<echo>, free_text, when_done},
    {{'M', 119}, "report endstops", ""},
    {{'M', 125}, "park and wait", "XYZLP", park, when_still},
    {{'M', 140}, "bed temperature", "SI", bed, printing},
    {{'M', 141}, "chamber temperature", "S"},
    {{'M', 145}, "material preset", "BFHS"},
    {{'M', 149}, "temperature units", "CFK"},
    {{'M', 150}, "lights", "BIKPRSUW"},
    {{'M', 155}, "report temperatures by itself", "S", sure<nothing>, loose},
    {{'M', 190}, "bed temperature, and wait", "SRI", bed_wait, when_done},
    {{'M', 191}, "chamber temperature, and wait", "SR"},
    {{'M', 200}, "volumetric extrusion", "DLST", volumetric, strict},
    {{'M', 201}, "largest accelerations", "XYZEFSTP", axis_accelerations},
    {{'M', 203}, "largest speeds", "XYZETP", axis_speeds},
    {{'M', 204}, "accelerations", "PRTS", accelerations},
    {{'M', 205}, "instantaneous speeds", "XYZEJSTB", instantaneous_speeds},
    {{'M', 206}, "home offset", "XYZ", home_offsets, strict},
    {{'M', 207}, "retraction", "SFZW", retraction_settings},
    {{'M', 208}, "recovery", "SFWR", recover_settings},
    {{'M', 209}, "automatic retraction", "S"},
    {{'M', 211}, "software endstops", "S"},
    {{'M', 220}, "speed factor", "SBR", speed_factor, printing},
    {{'M', 221}, "flow factor", "STD", flow_factor, printing},
    {{'M', 226}, "pause", "", pause, when_still},
    {{'M', 290}, "babystep", "XYZSP", refused},
    {{'M', 300}, "beep", "PS"},
    {{'M', 301}, "hot end PID", "CDEFHILP", hot_end_gains, printing, when_done},
    {{'M', 302}, "least temperature to extrude", "PS", cold_extrusion, always, when_done},
    {{'M', 303}, "tune PID", "CDESU", tune_gains, when_done},
    {{'M', 304}, "bed PID", "DIP", bed_gains, printing, when_done},
    {{'M', 306}, "heater model; with T: tune it", "ACEFHPRST", heater_model, when_done},
    {{'M', 355}, "case light", "PS"},
    {{'M', 400}, "wait for the moves", "", wait_for_moves, when_still},
    {{'M', 410}, "stop the moves", "", sure<nothing>, always},
    {{'M', 412}, "filament sensor", "DHRS"},
    {{'M', 413}, "power loss recovery", "S"},
    {{'M', 420}, "bed mesh", "CLSTVZ", follow_bed},
    {{'M', 421}, "a height of the bed mesh", "CEIJNQXYZ", refused},
    {{'M', 425}, "backlash", "FSXYZ"},
    {{'M', 428}, "home offset by the present place", "", home_offsets_here, strict},
    {{'M', 486}, "object labels", "ACPSTU", object_labels, named, printing},
    {{'M', 500}, "save settings", "", keep_settings, printing},
    {{'M', 501}, "load settings", "", restore_settings},
    {{'M', 502}, "factory settings", "", factory_settings},
    {{'M', 503}, "report settings", "CS", sure<report_settings>, always, loose, when_done},
    {{'M', 540}, "stop at endstop", "S"},
    {{'M', 555}, "print area", "XYWH"},
    {{'M', 556}, "skew correction by a printed square", "SPXYZ", refused},
    {{'M', 566}, "allowed speed changes", "XYZEP"},
    {{'M', 568}, "a tool's temperatures", "APRS", tool_temperatures, printing},
    {{'M', 569}, "stepper driver", "EISTXYZ"},
    {{'M', 572}, "pressure advance", "DSW", pressure_advance},
    {{'M', 579}, "scale axes", "XYZ", refused},
    {{'M', 593}, "input shaping", "DFPSTXY", input_shaping},
    {{'M', 600}, "filament change", "BELTUXYZR", filament_change, when_still},
    {{'M', 601}, "pause", "", pause, when_still},
    {{'M', 602}, "resume", ""},
    {{'M', 603}, "filament change lengths", "LTU"},
    {{'M', 665}, "a delta's measures", "ABCDHLRSVXYZ", refused},
    {{'M', 666}, "a delta's switches", "XYZ", refused},
    {{'M', 701}, "load filament", "LPTZ"},
    {{'M', 702}, "unload filament", "PTUZ"},
    {{'M', 808}, "repeat a part of the file", "L", refused},
    {{'M', 810}, "call or keep a macro", "", refused},
    {{'M', 851}, "probe offset", "XYZ"},
    {{'M', 852}, "skew correction", "IJKS", skew},
    {{'M', 862, Code::kAnySubcode}, "printer check", "PQTU"},
    {{'M', 862}, "printer check", ""},
    {{'M', 900}, "pressure advance", "KLST", linear_advance},
    {{'M', 906}, "motor current", "EITXYZ"},
    {{'M', 907}, "motor current", "BCDESXYZ"},
    {{'M', 914}, "sensorless homing", "IXYZ"},
    {{'S', 0}, "speed of a spindle, which is not there", "FS", lone_speed, strict},
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

/// The number that stands in the table: all tools are one family, and so are Marlin's M810 to M819.
std::uint32_t family_of(char letter, std::uint32_t number) {
    if (letter == 'M' && number > 810 && number < 820) return 810;
    return letter == 'T' ? 0 : number;
}

/// The row without a subcode.
const CodeInfo* find_family(char letter, std::uint32_t number) {
    return find_row({letter, family_of(letter, number)});
}

}  // namespace

std::span<const CodeInfo> known_codes() { return kCodes; }

const CodeInfo* find_code(const Command& command) {
    if (command.letter == '\0') return find_row(Code{command.word.view()});
    // T0 … T99 are known; the handler decides which of them exist.
    const bool is_no_tool = command.letter == 'T' && command.number >= 100;
    const std::uint32_t number = is_no_tool ? command.number : family_of(command.letter, command.number);
    if (!command.subcode) return find_row({command.letter, number});
    const CodeInfo* const exact = find_row({command.letter, number, *command.subcode});
    return exact != nullptr ? exact : find_row({command.letter, number, Code::kAnySubcode});
}

bool may_move(const Command& command) {
    return command.letter == '\0' ||
           std::string_view{"GTXYZEABCUVW"}.find(command.letter) != std::string_view::npos;
}

bool is_refused(const CodeInfo& code) { return code.handler == refused; }

bool takes_free_text(char letter, std::uint32_t number) {
    const CodeInfo* const code = find_family(letter, number);
    return code != nullptr && code->tail == free_text;
}

bool must_be_words(char letter, std::uint32_t number) {
    const CodeInfo* const code = find_family(letter, number);
    return code != nullptr && code->tail == words && code->handler != nullptr && !is_refused(*code);
}

bool takes_letter(char code, std::uint32_t number, char letter) {
    const CodeInfo* const row = find_family(code, number);
    return row == nullptr || row->parameters.find(letter) != std::string_view::npos;
}

bool ends_in_a_name(char letter, std::uint32_t number) {
    const CodeInfo* const code = find_family(letter, number);
    return code != nullptr && code->tail == named;
}

bool is_known_word(std::string_view word) {
    FixedString<32> upper;
    for (const char c : word) upper.push_back(to_upper(c));
    return word.size() <= decltype(upper)::kCapacity && find_row(Code{upper.view()}) != nullptr;
}

Typed may_be_typed(const Command& command) {
    const CodeInfo* const code = command.letter == '\0' ? find_row(Code{command.word.view()})
                                                        : find_family(command.letter, command.number);
    return code != nullptr ? code->typed : at_rest;
}

Ok ok_of(const Command& command) {
    const CodeInfo* const code = find_code(command);
    return code != nullptr && code->handler != nullptr ? code->ok : when_done;
}

bool takes_the_printer(const Command& command) {
    const CodeInfo* const code = find_code(command);
    if (code == nullptr) return command.letter != 'M';
    return code->handler != nullptr && code->handler != sure<nothing> && code->typed < printing;
}

}  // namespace qduino::printer::gcode
