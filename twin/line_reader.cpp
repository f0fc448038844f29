#include "twin/line_reader.h"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace qduino::twin {
namespace {

/// One word: a letter and, where there is one, its number. Advances `text` past it.
struct Word {
    char letter = 0;
    bool has_number = false;
    double number = 0;
};

void skip_blanks(std::string_view& text) {
    while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
}

Word take_word(std::string_view& text) {
    Word word;
    word.letter = text.front();
    if (word.letter >= 'a' && word.letter <= 'z') word.letter = static_cast<char>(word.letter - 'a' + 'A');
    text.remove_prefix(1);
    skip_blanks(text);
    std::string_view digits = text;
    if (!digits.empty() && digits.front() == '+') digits.remove_prefix(1);
    // Fixed notation: an E after a number is the next word, never an exponent ("X1E2" is X1 E2).
    const auto [end, error] =
        std::from_chars(digits.data(), digits.data() + digits.size(), word.number, std::chars_format::fixed);
    if (error != std::errc{}) return word;
    word.has_number = true;
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    return word;
}

char upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; }

bool is_of_word(char c) { return (upper(c) >= 'A' && upper(c) <= 'Z') || c == '_' || (c >= '0' && c <= '9'); }

/// Two letters or underscores begin a word.
bool begins_word(std::string_view line) {
    const auto begins = [](char c) { return (upper(c) >= 'A' && upper(c) <= 'Z') || c == '_'; };
    return line.size() >= 2 && begins(line[0]) && begins(line[1]);
}

/// A line with a number ends with a check sum, `N12 G1 X10*57`. In any other, `*` is a character.
bool is_numbered(std::string_view line) {
    skip_blanks(line);
    if (line.empty() || upper(line.front()) != 'N') return false;
    const Word number = take_word(line);
    return number.has_number;
}

/// The name of an object, which ends its line: `M486 Alid`. One in quotes does not.
bool begins_name(const CommandLine& command, std::string_view line) {
    if (command.letter != 'M' || command.number != 486 || upper(line.front()) != 'A') return false;
    line.remove_prefix(1);
    skip_blanks(line);
    return line.empty() || line.front() != '"' || line.find('"', 1) == std::string_view::npos;
}

CommandLine word_line(std::string_view line) {
    CommandLine command;
    while (!line.empty() && is_of_word(line.front())) {
        command.word += upper(line.front());
        line.remove_prefix(1);
    }
    command.tail = line;
    return command;
}

}  // namespace

std::optional<std::string_view> CommandLine::word_value(std::string_view key) const {
    std::string_view rest = tail;
    while (!rest.empty()) {
        skip_blanks(rest);
        const std::size_t equals = rest.find_first_of("= \t");
        if (equals == std::string_view::npos) return std::nullopt;
        const std::string_view name = rest.substr(0, equals);
        rest.remove_prefix(equals);
        if (rest.front() != '=') continue;
        rest.remove_prefix(1);
        const bool quoted = !rest.empty() && (rest.front() == '"' || rest.front() == '\'');
        if (quoted) rest.remove_prefix(1);
        const std::size_t end = std::min(rest.find_first_of(quoted ? "\"'" : " \t"), rest.size());
        if (std::ranges::equal(name, key, {}, upper, upper)) return rest.substr(0, end);
        rest.remove_prefix(std::min(end + (quoted ? 1 : 0), rest.size()));
    }
    return std::nullopt;
}

std::optional<double> CommandLine::word_number(std::string_view key) const {
    std::optional<std::string_view> digits = word_value(key);
    if (!digits) return std::nullopt;
    if (!digits->empty() && digits->front() == '+') digits->remove_prefix(1);
    double given = 0;
    const auto [end, error] =
        std::from_chars(digits->data(), digits->data() + digits->size(), given, std::chars_format::fixed);
    return error == std::errc{} ? std::optional{given} : std::nullopt;
}

CommandLine LineReader::parse(std::string_view line) {
    CommandLine command;
    line = line.substr(0, line.find(';'));
    if (is_numbered(line)) line = line.substr(0, line.rfind('*'));  // a check sum
    while (!line.empty() && line.back() == ' ') line.remove_suffix(1);
    for (skip_blanks(line); !line.empty(); skip_blanks(line)) {
        if (line.front() == '(') {  // a comment in the middle of a line
            const std::size_t end = line.find(')');
            line.remove_prefix(end == std::string_view::npos ? line.size() : end + 1);
            continue;
        }
        const char first = line.front();
        if (first == '"' && command.letter != 0) {  // the name behind a letter: P"mzv"
            const std::size_t end = std::min(line.find('"', 1), line.size());
            command.tail = line.substr(1, end - 1);
            line.remove_prefix(std::min(end + 1, line.size()));
            continue;
        }
        const bool letter = (first >= 'A' && first <= 'Z') || (first >= 'a' && first <= 'z');
        if (!letter) {
            if (command.letter == 0) return command;  // not a command at all
            line.remove_prefix(1);
            continue;
        }
        if (command.letter == 0 && begins_word(line)) return word_line(line);
        if (begins_name(command, line)) return command;
        const Word word = take_word(line);
        if (command.letter == 0) {
            if (word.letter == 'N' && word.has_number) continue;  // line number
            if ((word.letter != 'G' && word.letter != 'M') || !word.has_number) return command;
            command.letter = word.letter;
            command.number = static_cast<int>(word.number);
            command.subcode = static_cast<int>(std::lround((word.number - command.number) * 10));
            continue;
        }
        const unsigned index = static_cast<unsigned>(word.letter - 'A');
        command.present |= 1u << index;
        if (!word.has_number) continue;
        command.numbers |= 1u << index;
        command.values[index] = word.number;
    }
    return command;
}

}  // namespace qduino::twin
