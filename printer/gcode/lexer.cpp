#include "printer/gcode/lexer.h"

#include <algorithm>
#include <utility>

#include "printer/gcode/command_table.h"
#include "printer/gcode/text.h"

namespace qduino::printer::gcode {
namespace {

constexpr std::uint64_t kNumberMax = 99'999;

void skip_spaces(std::string_view& text) {
    while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
}

Error malformed(std::string_view what, std::string_view around) {
    FixedString<96> shown;
    append_printable(shown, around.substr(0, 24));
    return make_error(ErrorCode::invalid_argument, what, " at '", shown, "'");
}

/// Digits of a code's number or subcode.
std::optional<std::uint32_t> take_code_number(std::string_view& text) {
    std::string_view rest = text;
    const auto number = take_integer(rest);
    if (!number || *number > kNumberMax) return std::nullopt;
    text = rest;
    return static_cast<std::uint32_t>(*number);
}

/// `G92.1`: letter, number, subcode.
Result<void> take_code(std::string_view& rest, Command& command) {
    const std::string_view start = rest;
    command.letter = to_upper(rest.front());
    rest.remove_prefix(1);
    skip_spaces(rest);
    const auto number = take_code_number(rest);
    if (!number) return malformed("a command needs a number behind its letter,", start);
    command.number = *number;
    if (!rest.empty() && rest.front() == '.') {
        rest.remove_prefix(1);
        const auto subcode = take_code_number(rest);
        if (!subcode || *subcode > 0xFFFF) return malformed("a subcode is not a number", start);
        command.subcode = static_cast<std::uint16_t>(*subcode);
    }
    return {};
}

/// `"…"` behind a letter: the letter is present, the string becomes the command's text.
Result<void> take_string(std::string_view& rest, Command& command) {
    const std::size_t end = rest.find('"', 1);
    if (end == std::string_view::npos) return malformed("a quote without its end", rest);
    if (command.text.empty()) command.text_cut = !append_printable(command.text, rest.substr(1, end - 1));
    rest.remove_prefix(end + 1);
    return {};
}

bool take_text(std::string_view tail, Command& command) {
    command.text_cut = !append_printable(command.text, trim(tail));
    return true;
}

/// A name behind its letter: in quotes, or to the end of the line.
Result<void> take_name(std::string_view& rest, Command& command) {
    if (rest.starts_with('"') && rest.find('"', 1) != std::string_view::npos)
        return take_string(rest, command);
    take_text(std::exchange(rest, {}), command);
    return {};
}

/// One parameter: a letter, and what may stand behind it. `named`: A begins a name.
Result<void> take_parameter(std::string_view& rest, Command& command, bool named) {
    const std::string_view start = rest;
    const char letter = to_upper(rest.front());
    if (!is_letter(letter)) return malformed("expected a letter", rest);
    if (command.parameters.has(letter)) return malformed("the same letter twice on a line,", rest);
    if (letter == 'G' || letter == 'M') return malformed("more than one command on a line,", rest);
    rest.remove_prefix(1);
    skip_spaces(rest);
    if (named && letter == 'A') {
        command.parameters.add(letter);
        return take_name(rest, command);
    }
    if (!rest.empty() && rest.front() == '"') {
        command.parameters.add(letter);
        return take_string(rest, command);
    }
    if (rest.empty() || is_letter(rest.front())) {
        command.parameters.add(letter);
        return {};
    }
    const auto value = take_number(rest);
    if (!value) return malformed("not a number", start);
    command.parameters.add(letter, *value);
    return {};
}

Result<void> take_parameters(std::string_view rest, Command& command, bool named) {
    for (skip_spaces(rest); !rest.empty(); skip_spaces(rest)) {
        QDUINO_TRY(take_parameter(rest, command, named));
    }
    return {};
}

void take_word(std::string_view code, Command& command) {
    const std::string_view word = leading_word(code);
    for (const char c : word) command.word.push_back(to_upper(c));
    take_text(code.substr(word.size()), command);
}

}  // namespace

bool is_word_command(std::string_view code) {
    const auto begins = [](char c) { return is_letter(c) || c == '_'; };
    return code.size() >= 2 && begins(code[0]) && begins(code[1]);
}

std::string_view leading_word(std::string_view code) {
    const auto ends = [](char c) { return !is_letter(c) && !is_digit(c) && c != '_'; };
    const auto end = std::ranges::find_if(code, ends);
    return code.substr(0, static_cast<std::size_t>(end - code.begin()));
}

LeadingCode leading_code(std::string_view code) {
    if (code.empty() || !is_letter(code.front())) return {};
    const char letter = to_upper(code.front());
    code.remove_prefix(1);
    skip_spaces(code);
    const auto number = take_code_number(code);
    return number ? LeadingCode{letter, *number} : LeadingCode{};
}

Result<bool> parse_words(std::string_view code, Command& command) {
    command.clear();
    std::string_view rest = trim(code);
    if (rest.empty() || rest == "%") return false;  // RS274's mark of a tape's ends
    if (is_word_command(rest)) {
        take_word(rest, command);
        return true;
    }
    if (!is_letter(rest.front())) return malformed("a command begins with a letter, not", rest);
    QDUINO_TRY(take_code(rest, command));
    if (takes_free_text(command.letter, command.number)) return take_text(rest, command);
    const std::string_view tail = rest;
    const bool named = ends_in_a_name(command.letter, command.number);
    const Result<void> taken = take_parameters(rest, command, named);
    if (taken) return true;
    if (named || must_be_words(command.letter, command.number)) return taken.error();
    command.parameters.clear();
    command.text.clear();
    return take_text(tail, command);
}

}  // namespace qduino::printer::gcode
