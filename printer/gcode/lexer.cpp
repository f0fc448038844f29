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

/// `E` behind a digit begins the next word in a packed line (`G1X60Y40E1`), and an exponent in any
/// other (`X4e1`): generators write 8.5e-05 for what is nearly 0. A line is packed when words
/// follow one another without a blank. A sign of +, or two digits of which the first is 0, are an
/// exponent wherever they stand: so does printf write one, and nobody a length.
bool is_exponent(std::string_view exponent, std::string_view code, const Command& command) {
    const bool signed_up = exponent[1] == '+';
    const bool padded = exponent.size() >= 4 && exponent[1] == '-' && exponent[2] == '0';
    if (signed_up || padded || !takes_letter(command.letter, command.number, 'E')) return true;
    for (std::size_t i = 1; i < code.size(); ++i) {
        const bool glued = is_letter(code[i]) && (is_digit(code[i - 1]) || code[i - 1] == '.');
        if (glued && to_upper(code[i]) != 'E') return false;
    }
    return true;
}

/// The number behind a parameter's letter. None: there is none.
std::optional<double> take_value(std::string_view& rest, std::string_view code, const Command& command) {
    std::string_view plain = rest;
    const auto number = take_number(plain);
    const std::size_t exponent = number ? exponent_size(plain) : 0;
    const bool behind_digit = exponent != 0 && is_digit(rest[rest.size() - plain.size() - 1]);
    if (!behind_digit || !is_exponent(plain.substr(0, exponent), code, command)) {
        if (number) rest = plain;
        return number;
    }
    return take_scientific(rest);
}

/// One parameter of the line `code`: a letter, and what may stand behind it. `named`: A begins a
/// name.
Result<void> take_parameter(std::string_view& rest, std::string_view code, Command& command, bool named) {
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
    const auto value = take_value(rest, code, command);
    if (!value) return malformed("not a number", start);
    command.parameters.add(letter, *value);
    return {};
}

Result<void> take_parameters(std::string_view rest, std::string_view code, Command& command, bool named) {
    for (skip_spaces(rest); !rest.empty(); skip_spaces(rest)) {
        QDUINO_TRY(take_parameter(rest, code, command, named));
    }
    return {};
}

/// `F600` or `S5000 F600`, a speed without a motion: the whole line is parameters.
Result<void> take_lone_speed(std::string_view code, Command& command) {
    command.letter = to_upper(code.front());
    return take_parameters(code, code, command, false);
}

/// `T?`: which tool is to be asked of a person (Prusa's).
bool is_open_tool(std::string_view code) {
    return code.size() == 2 && to_upper(code[0]) == 'T' && code[1] == '?';
}

/// A word's tail holds names, and bytes of other encodings in them: each bad byte is written as its
/// number, so that names that differ still do.
Result<void> take_word(std::string_view code, Command& command) {
    const std::string_view word = leading_word(code);
    if (word.size() > decltype(command.word)::kCapacity)
        return malformed("no command is a word that long,", code);
    for (const char c : word) command.word.push_back(to_upper(c));
    command.text_cut = !append_escaped(command.text, trim(code.substr(word.size())));
    return {};
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
        QDUINO_TRY(take_word(rest, command));
        return true;
    }
    if (is_open_tool(rest)) {
        command.word.assign("T?");
        return true;
    }
    if (to_upper(rest.front()) == 'F' || to_upper(rest.front()) == 'S') {
        QDUINO_TRY(take_lone_speed(rest, command));
        return true;
    }
    if (!is_letter(rest.front())) return malformed("a command begins with a letter, not", rest);
    QDUINO_TRY(take_code(rest, command));
    if (takes_free_text(command.letter, command.number)) return take_text(rest, command);
    const std::string_view tail = rest;
    const bool named = ends_in_a_name(command.letter, command.number);
    const Result<void> taken = take_parameters(rest, trim(code), command, named);
    if (taken) return true;
    if (named || must_be_words(command.letter, command.number)) return taken.error();
    command.parameters.clear();
    command.text.clear();
    return take_text(tail, command);
}

}  // namespace qduino::printer::gcode
