#include "printer/gcode/content.h"

#include <algorithm>
#include <utility>

#include "printer/gcode/command_table.h"
#include "printer/gcode/lexer.h"
#include "printer/gcode/parser.h"
#include "printer/gcode/text.h"

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

/// The first bytes of files that hold others: ZIP (PKWARE's APPNOTE), gzip (RFC 1952), bzip2, xz,
/// Zstandard (RFC 8878), 7-Zip, RAR; and of Prusa's .bgcode.
constexpr std::pair<std::string_view, Content> kMagic[]{
    {"GCDE", Content::binary_gcode},
    {"PK\x03\x04", Content::archive},
    {"PK\x05\x06", Content::archive},
    {"\x1F\x8B", Content::packed},
    {"BZh", Content::packed},
    {"\xFD"
     "7zXZ",
     Content::packed},
    {"\x28\xB5\x2F\xFD", Content::packed},
    {"7z\xBC\xAF", Content::packed},
    {"Rar!", Content::packed},
};

/// A byte order mark of two bytes, or a zero in every other one.
bool is_utf16(std::string_view text) {
    if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF")) return true;
    const std::string_view some = text.substr(0, 64);
    if (some.size() < 8) return false;
    std::size_t zeros[2] = {};
    for (std::size_t i = 0; i < some.size(); ++i) zeros[i % 2] += some[i] == '\0' ? 1 : 0;
    const std::size_t half = some.size() / 2;
    return (zeros[0] == 0 && zeros[1] == half) || (zeros[1] == 0 && zeros[0] >= half);
}

/// Without text there is nothing whose end is missing.
bool ends_in_nul(std::string_view text) {
    const std::size_t nul = text.find('\0');
    return nul != std::string_view::npos && nul > 0 &&
           text.find_first_not_of('\0', nul) == std::string_view::npos &&
           std::none_of(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(nul), is_binary);
}

/// Known by their first word.
Content kind_of_text(std::string_view text) {
    std::string_view rest = text;
    skip_prefix(rest, "\xEF\xBB\xBF");
    rest.remove_prefix(std::min(rest.find_first_not_of(" \t\r\n"), rest.size()));
    const auto begins = [&](std::string_view word) {
        return rest.size() >= word.size() &&
               std::ranges::equal(rest.substr(0, word.size()), word, {}, to_upper);
    };
    if (begins("<!DOCTYPE HTML") || begins("<HTML")) return Content::web_page;
    const bool is_stl = begins("SOLID") && text.find("facet") != std::string_view::npos;
    const bool is_obj = begins("MTLLIB ") || begins("V ") || text.find("\nv ") != std::string_view::npos;
    return is_stl || begins("ISO-10303-21") || is_obj ? Content::model : Content::other_text;
}

/// True for a line that is a command, malformed or one of several: `G21 G90`. Which is wrong with
/// it is preflight's question.
bool is_spoiled_command(const Line& line) {
    const LeadingCode code = leading_code(trim(line.text));
    Command command;
    command.letter = code.letter;
    command.number = code.number;
    return code.letter != '\0' && find_code(command) != nullptr;
}

/// A program's number, `O1000 (PART)`, which a controller of machine tools wants at its beginning
/// (RS-274, ISO 6983).
bool is_program_number(const Line& line) {
    const LeadingCode code = leading_code(trim(line.text));
    return code.letter == 'O';
}

}  // namespace

Content look_at_content(std::span<const char> bytes, const MachineConfig& machine) {
    const std::string_view text{bytes.data(), bytes.size()};
    for (const auto& [magic, content] : kMagic)
        if (text.starts_with(magic)) return content;
    if (is_utf16(text)) return Content::utf16;
    if (ends_in_nul(text)) return Content::cut_off;
    if (std::any_of(bytes.begin(), bytes.end(), is_binary)) return Content::binary;
    if (text.find_first_not_of(" \t\r\n\v\f") == std::string_view::npos) return Content::empty;
    int speak_for_it = 0;  // commands in the table, and lines that are a `;` comment
    int speak_against = 0;
    bool is_for_a_tool = false;
    const auto count = [&](const Line& line) {
        const bool comment = line.command == nullptr && !line.comment.empty();
        const bool known = line.command != nullptr && is_known(*line.command, machine);
        if (line.command != nullptr && !known && may_be_macro(*line.command)) return;
        const bool spoiled = line.error && is_spoiled_command(line);
        is_for_a_tool = is_for_a_tool || spoiled || is_program_number(line);
        if (spoiled) return;
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
    if (speak_for_it > speak_against) return Content::gcode;
    const Content kind = kind_of_text(text);
    return kind == Content::other_text && is_for_a_tool ? Content::machine_tool : kind;
}

std::string_view explain(Content content) {
    constexpr std::string_view kWords[]{
        "",
        "The file is empty.",
        "This is binary G-code (.bgcode). Switch off \"Supports binary G-code\" in the slicer's printer "
        "settings, or convert the file, and send it again.",
        "This is a package (.3mf, .gcode.3mf or .ufp: a ZIP archive), not plain G-code. A sliced one: export "
        "it as "
        "\"G-code\" (OrcaSlicer and Bambu Studio: \"Export G-code\"; Cura: file type .gcode). A model: slice "
        "it.",
        "This is a packed file (.gz or its like). Unpack it, and send the .gcode file that is in it.",
        "This text is in UTF-16. Save it as UTF-8, or as plain (ANSI) text, and send it again.",
        "The file ends in NUL bytes: its end was never written (a full disk, a card that was taken out). "
        "Export "
        "it again.",
        "This is a binary file, not G-code. If it is a model, slice it first.",
        "This is a model, not G-code. Slice it first.",
        "This is a web page, not G-code: the link led to the page about the file. Download the file itself.",
        "This is a program for a machine tool (a mill, a lathe), not for a printer. Slice the model.",
        "This is a text, but not G-code: its first lines hold no command.",
    };
    return kWords[static_cast<std::size_t>(content)];
}

}  // namespace qduino::printer::gcode
