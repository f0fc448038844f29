#include "printer/gcode/content.h"

#include <algorithm>

#include "printer/gcode/command_table.h"
#include "printer/gcode/parser.h"

namespace qduino::printer::gcode {
namespace {

/// Control characters that text does not have: all below space except tab, line feed, vertical tab,
/// form feed, CR; and DEL.
bool is_binary(char c) {
    const auto byte = static_cast<unsigned char>(c);
    return (byte < 0x20 && !(byte >= 0x09 && byte <= 0x0D)) || byte == 0x7F;
}

bool is_known(const Command& command, const MachineConfig& machine) {
    const auto is_it = [&](const Macro& macro) { return macro.name.view() == command.word.view(); };
    const bool is_macro = command.letter == '\0' && std::ranges::any_of(machine.macros, is_it);
    return is_macro || find_code(command) != nullptr;
}

/// A macro's call, as far as it looks: `PRINT_START`, `START BED=60`. Whether there is such a macro
/// is preflight's question.
bool may_be_macro(const Command& command) {
    const auto has = [](std::string_view text, char c) { return text.find(c) != std::string_view::npos; };
    return command.letter == '\0' && (has(command.word.view(), '_') || has(command.text.view(), '='));
}

}  // namespace

Content look_at_content(std::span<const char> bytes, const MachineConfig& machine) {
    const std::string_view text{bytes.data(), bytes.size()};
    if (text.starts_with("GCDE")) return Content::binary_gcode;
    if (std::any_of(bytes.begin(), bytes.end(), is_binary)) return Content::binary;
    if (text.find_first_not_of(" \t\r\n\v\f") == std::string_view::npos) return Content::empty;
    int speak_for_it = 0;  // commands in the table, and lines that are a `;` comment
    int speak_against = 0;
    const auto count = [&](const Line& line) {
        const bool comment = line.command == nullptr && !line.comment.empty();
        const bool known = line.command != nullptr && is_known(*line.command, machine);
        if (line.command != nullptr && !known && may_be_macro(*line.command)) return;
        if (line.error || (line.command != nullptr && !known)) {
            ++speak_against;
        } else if (known || comment) {
            ++speak_for_it;
        }
    };
    Parser parser;
    parser.feed(bytes, count);
    // The last line is cut wherever the caller's buffer ended: it counts only when no other line
    // does.
    if (speak_for_it + speak_against == 0) parser.finish(count);
    return speak_for_it > speak_against ? Content::gcode : Content::other_text;
}

std::string_view explain(Content content) {
    constexpr std::string_view kWords[]{
        "",
        "The file is empty.",
        "This is binary G-code (.bgcode). Switch off \"Supports binary G-code\" in the slicer's printer "
        "settings, or convert the file, and send it again.",
        "This is a binary file, not G-code. Slice the model first.",
        "This is a text, but not G-code: its first lines hold no command.",
    };
    return kWords[static_cast<std::size_t>(content)];
}

}  // namespace qduino::printer::gcode
