#include "config/macro_check.h"

#include <cstdint>

#include "base/text.h"
#include "printer/gcode/command_table.h"
#include "printer/gcode/expansion.h"
#include "printer/gcode/parser.h"

namespace qduino::apps {
namespace {

namespace gcode = printer::gcode;

/// A call that gives every parameter of `lines` a value.
std::string full_call(std::string_view lines) {
    std::string arguments;
    for (std::size_t open = lines.find('{'); open != std::string_view::npos; open = lines.find('{', open + 1))
        write(arguments, lines.substr(open + 1, lines.find_first_of("}=", open) - open - 1), "=1 ");
    return arguments;
}

enum class Place : std::uint8_t { macro, job };

/// Why no job can carry `line` out; empty when one may.
std::string line_error(const printer::MachineConfig& machine, std::string_view line, Place place) {
    const auto command = gcode::parse_line(line);
    if (!command) return std::string{command.error().message.view()};
    if (!*command) return "";
    if ((*command)->letter == '\0' && gcode::find_macro(machine, (*command)->word.view()))
        return place == Place::macro ? "a macro calls no macro" : "";
    const gcode::CodeInfo* const known = gcode::find_code(**command);
    if (known && gcode::is_refused(*known))
        return text<std::string>(known->name, " is not done by this printer");
    if (!known && gcode::may_move(**command)) return "this printer has no such code, and it may move";
    return "";
}

/// What is wrong with `lines`, which are called `name` here and get `arguments`.
std::string errors_in(const printer::MachineConfig& machine, std::string_view name, std::string_view text,
                      const std::string& arguments, Place place) {
    const std::string_view what = place == Place::macro ? "macro " : "";
    std::string out;
    gcode::Expansion lines;
    if (const auto begun = lines.begin(name, text, arguments); !begun)
        write(out, "  ", what, begun.error().message, '\n');
    for (int number = 1; lines.active(); ++number) {
        const std::string_view line = lines.next();
        if (const std::string error = line_error(machine, line, place); !error.empty())
            write(out, "  ", what, name, ", line ", number, ", ", line, ": ", error, '\n');
    }
    return out;
}

}  // namespace

std::string macro_errors(const printer::MachineConfig& machine) {
    std::string out =
        errors_in(machine, "[start] gcode", machine.start.text.view(), "HOT_END=200 BED=60", Place::job);
    for (const printer::Macro& macro : machine.macros)
        out += errors_in(machine, macro.name.view(), macro.text.view(), full_call(macro.text.view()),
                         Place::macro);
    return out;
}

}  // namespace qduino::apps
