#include "printer/gcode/command_table.h"

#include <array>

namespace qduino::printer::gcode {
namespace {

constexpr std::int32_t kNoSubcode = -1;
constexpr std::int32_t kAnySubcode = -2;

constexpr CodeInfo done(char letter, std::uint32_t number, std::string_view name,
                        std::string_view parameters) {
    return {letter, number, kNoSubcode, {}, name, parameters, CodeStatus::executed, Strictness::lenient};
}
/// Moves, or moves the coordinates: what is not understood is refused.
constexpr CodeInfo strict(char letter, std::uint32_t number, std::string_view name,
                          std::string_view parameters) {
    return {letter, number, kNoSubcode, {}, name, parameters, CodeStatus::executed, Strictness::strict};
}
constexpr CodeInfo later(char letter, std::uint32_t number, std::string_view name,
                         std::string_view parameters) {
    return {letter, number, kNoSubcode, {}, name, parameters, CodeStatus::acknowledged, Strictness::lenient};
}
constexpr CodeInfo with_subcode(CodeInfo code, std::int32_t subcode) {
    code.subcode = subcode;
    return code;
}
constexpr CodeInfo later_word(std::string_view word, std::string_view name) {
    return {'\0', 0, kNoSubcode, word, name, {}, CodeStatus::acknowledged, Strictness::lenient};
}

/// Ordered by how often a job uses them, as they are looked up from the front: G1 is more than 95 % of a
/// sliced file.
constexpr std::array kCodes{
    strict('G', 1, "linear move", "XYZEF"),
    strict('G', 0, "travel move", "XYZEF"),
    strict('G', 2, "arc, clockwise", "XYZEFIJRP"),
    strict('G', 3, "arc, counterclockwise", "XYZEFIJRP"),
    strict('G', 92, "set position", "XYZE"),
    done('M', 106, "fan on", "SP"),
    done('M', 107, "fan off", "P"),
    done('M', 73, "progress", "PRQS"),
    done('M', 204, "accelerations", "PRTS"),
    done('M', 205, "instantaneous speeds", "XYZEJSTB"),
    done('M', 104, "hot end temperature", "STRIBF"),
    done('M', 109, "hot end temperature, and wait", "SRTIBF"),
    done('M', 105, "report temperatures", "T"),
    done('M', 140, "bed temperature", "SI"),
    done('M', 190, "bed temperature, and wait", "SRI"),
    done('M', 117, "message", ""),
    done('G', 4, "dwell", "SP"),
    strict('G', 10, "retract", "S"),
    strict('G', 11, "recover from retraction", ""),
    done('G', 17, "XY plane", ""),
    done('G', 20, "inches", ""),
    done('G', 21, "millimetres", ""),
    strict('G', 28, "home", "XYZORLW"),
    done('G', 90, "absolute coordinates", ""),
    done('G', 91, "relative coordinates", ""),
    with_subcode(strict('G', 92, "machine coordinates", ""), 1),
    done('M', 82, "absolute extrusion", ""),
    done('M', 83, "relative extrusion", ""),
    done('M', 84, "motors off", "SXYZE"),
    done('M', 18, "motors off", "SXYZE"),
    done('M', 0, "stop and wait", ""),
    done('M', 1, "stop and wait", ""),
    done('M', 110, "line number", "N"),
    done('M', 112, "emergency stop", ""),
    done('M', 114, "report position", "DER"),
    done('M', 115, "report firmware", ""),
    done('M', 118, "echo", ""),
    done('M', 201, "largest accelerations", "XYZEFSTP"),
    done('M', 203, "largest speeds", "XYZETP"),
    done('M', 207, "retraction", "SFZW"),
    done('M', 208, "recovery", "SFWR"),
    done('M', 220, "speed factor", "SBR"),
    done('M', 221, "flow factor", "ST"),
    done('M', 400, "wait for the moves", ""),
    done('M', 600, "filament change", "BELTUXYZR"),
    done('M', 601, "pause", ""),
    done('T', 0, "tool", ""),

    later('G', 12, "clean the nozzle", "PRSTXYZ"),
    later('G', 26, "mesh validation pattern", "BCDFHIKLOPQRSUXY"),
    later('G', 27, "park", "P"),
    later('G', 29, "probe the bed mesh", "ABCDEFHIJKLOPQRSTUVWXYZ"),
    later('G', 30, "probe one point", "CXY"),
    later('G', 34, "align Z", ""),
    later('G', 80, "bed mesh on", ""),
    later('M', 17, "motors on", "XYZE"),
    later('M', 20, "list files", "FLT"),
    later('M', 21, "card begins", ""),
    later('M', 22, "card ends", ""),
    later('M', 23, "select file", ""),
    later('M', 24, "start file", "ST"),
    later('M', 25, "pause file", ""),
    later('M', 27, "file progress", "CS"),
    later('M', 28, "write file", ""),
    later('M', 29, "end of written file", ""),
    later('M', 30, "delete file", ""),
    later('M', 31, "print time", ""),
    later('M', 42, "switch a pin", "IPST"),
    later('M', 74, "print weight", "W"),
    later('M', 75, "print timer on", ""),
    later('M', 76, "print timer pause", ""),
    later('M', 77, "print timer off", ""),
    later('M', 85, "inactivity shutdown", "S"),
    later('M', 92, "steps per millimetre", "XYZE"),
    later('M', 108, "end a wait", ""),
    later('M', 111, "debug level", "S"),
    later('M', 113, "host keepalive", "S"),
    later('M', 119, "report endstops", ""),
    later('M', 141, "chamber temperature", "S"),
    later('M', 145, "material preset", "BFHS"),
    later('M', 149, "temperature units", "CFK"),
    later('M', 150, "lights", "BIKPRSUW"),
    later('M', 155, "report temperatures by itself", "S"),
    later('M', 191, "chamber temperature, and wait", "SR"),
    later('M', 200, "volumetric extrusion", "DLST"),
    later('M', 206, "home offset", "PTXYZ"),
    later('M', 209, "automatic retraction", "S"),
    later('M', 211, "software endstops", "S"),
    later('M', 300, "beep", "PS"),
    later('M', 301, "hot end PID", "CDEFILP"),
    later('M', 302, "cold extrusion", "PS"),
    later('M', 303, "tune PID", "CDESU"),
    later('M', 304, "bed PID", "DIP"),
    later('M', 355, "case light", "PS"),
    later('M', 410, "stop the moves", ""),
    later('M', 412, "filament sensor", "DHRS"),
    later('M', 413, "power loss recovery", "S"),
    later('M', 420, "bed mesh", "CLSTVZ"),
    later('M', 425, "backlash", "FSXYZ"),
    later('M', 486, "object labels", "ACPSTU"),
    later('M', 500, "save settings", ""),
    later('M', 501, "load settings", ""),
    later('M', 502, "factory settings", ""),
    later('M', 503, "report settings", "CS"),
    later('M', 540, "stop at endstop", "S"),
    later('M', 555, "print area", "XYWH"),
    later('M', 566, "allowed speed changes", "XYZEP"),
    later('M', 569, "stepper driver", "EISTXYZ"),
    later('M', 572, "pressure advance", "DSW"),
    later('M', 593, "input shaping", "DFPXY"),
    later('M', 602, "resume", ""),
    later('M', 603, "filament change lengths", "LTU"),
    later('M', 701, "load filament", "LPTZ"),
    later('M', 702, "unload filament", "PTUZ"),
    later('M', 851, "probe offset", "XYZ"),
    later('M', 862, "printer check", ""),
    with_subcode(later('M', 862, "printer check", "PQTU"), kAnySubcode),
    later('M', 900, "pressure advance", "KLST"),
    later('M', 906, "motor current", "EITXYZ"),
    later('M', 907, "motor current", "BCDESXYZ"),
    later('M', 914, "sensorless homing", "IXYZ"),
    later_word("EXCLUDE_OBJECT", "leave an object out"),
    later_word("EXCLUDE_OBJECT_DEFINE", "name an object"),
    later_word("EXCLUDE_OBJECT_START", "an object begins"),
    later_word("EXCLUDE_OBJECT_END", "an object ends"),
};

bool subcode_matches(const CodeInfo& code, const Command& command) {
    if (!command.subcode) return code.subcode == kNoSubcode;
    return code.subcode == kAnySubcode || code.subcode == static_cast<std::int32_t>(*command.subcode);
}

/// M codes whose tail is a message, a file name, or (M115 U3.13.3) a version.
constexpr std::array<std::uint32_t, 11> kFreeTextCodes{0, 1, 23, 28, 30, 32, 33, 115, 117, 118, 928};

}  // namespace

std::span<const CodeInfo> known_codes() { return kCodes; }

const CodeInfo* find_code(const Command& command) {
    // Tools are one family: T0 … T99 are known; which of them exist, the handler says.
    const std::uint32_t number = command.letter == 'T' && command.number < 100 ? 0 : command.number;
    for (const CodeInfo& code : kCodes) {
        if (code.letter != command.letter || code.number != number) continue;
        if (command.letter == '\0' ? code.word == command.word.view() : subcode_matches(code, command))
            return &code;
    }
    return nullptr;
}

bool takes_free_text(char letter, std::uint32_t number) {
    if (letter != 'M') return false;
    for (const std::uint32_t code : kFreeTextCodes) {
        if (code == number) return true;
    }
    return false;
}

bool must_be_words(char letter, std::uint32_t number) {
    if (takes_free_text(letter, number)) return false;
    for (const CodeInfo& code : kCodes) {
        const bool same = code.letter == letter && (code.number == number || letter == 'T');
        if (same && code.status == CodeStatus::executed) return true;
    }
    return false;
}

}  // namespace qduino::printer::gcode
