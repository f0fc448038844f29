#include "printer/gcode/dialect.h"

#include <algorithm>

#include "printer/gcode/text.h"

namespace qduino::printer::gcode {
namespace {

/// M-codes that RepRapFirmware alone has: tools, pressure advance, allowed jerks, drives, filament.
constexpr std::uint32_t kRepRapCodes[]{563, 566, 567, 568, 572, 584, 591, 703};

/// Prusa's machines of 8 bits. The MK3.5 and the MK3.9 are not: their firmware is of Marlin 2.
bool is_mk3(std::string_view model) {
    const bool is_old = model.starts_with("MK2") || model.starts_with("MK3");
    return is_old && !model.starts_with("MK3.5") && !model.starts_with("MK3.9");
}

bool is(std::string_view text, std::string_view word) { return std::ranges::equal(text, word, {}, to_upper); }

}  // namespace

Dialect dialect_of(const Command& command) {
    if (command.letter == '\0') {
        const bool is_prusas = command.word == "T?" || command.word == "TX" || command.word == "TC";
        return is_prusas ? Dialect::marlin : Dialect::klipper;
    }
    if (command.letter == 'G')
        return command.number == 10 && command.parameters.has('P') ? Dialect::reprap : Dialect::marlin;
    if (command.letter != 'M') return Dialect::marlin;
    const bool is_check = command.number == 862 && is_mk3(command.text);
    const bool is_reprap = std::ranges::find(kRepRapCodes, command.number) != std::end(kRepRapCodes);
    return is_check || is_reprap ? Dialect::reprap : Dialect::marlin;
}

Dialect dialect_of_comment(std::string_view comment) {
    comment = trim(comment);
    if (skip_prefix(comment, "FLAVOR:")) return is(comment, "REPRAP") ? Dialect::reprap : Dialect::marlin;
    if (skip_prefix(comment, "gcode_flavor = "))
        return is(comment, "KLIPPER")          ? Dialect::klipper
               : is(comment, "REPRAPFIRMWARE") ? Dialect::reprap
                                               : Dialect::marlin;
    if (skip_prefix(comment, "printer_model = ")) return is_mk3(comment) ? Dialect::reprap : Dialect::marlin;
    return Dialect::marlin;
}

std::string_view name_of(Dialect dialect) {
    constexpr std::string_view kNames[]{"Marlin", "RepRapFirmware", "Klipper"};
    return kNames[static_cast<std::size_t>(dialect)];
}

}  // namespace qduino::printer::gcode
