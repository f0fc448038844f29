#include "twin/line_reader.h"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace qduino::twin {
namespace {

/// No firmware has a code of that number.
constexpr double kCodeNumberEnd = 1'000'000;

/// One word: a letter and, where there is one, its number. Advances `text` past it.
struct Word {
    char letter = 0;
    bool has_number = false;
    double number = 0;
};

void skip_blanks(std::string_view& text) {
    while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); }

/// Words that follow one another without a blank: `G1X60Y40E1`.
bool is_packed(std::string_view line) {
    for (std::size_t i = 1; i < line.size(); ++i) {
        const bool touches = is_digit(line[i - 1]) || line[i - 1] == '.';
        if (touches && is_letter(line[i]) && line[i] != 'e' && line[i] != 'E') return true;
    }
    return false;
}

/// What the E behind a digit may be.
enum class Exponents : std::uint8_t {
    all,      ///< always an exponent: the command has no word E, or words stand apart
    certain,  ///< only where a program has written it: e+3, e-05
    none,
};

/// The bytes of an exponent at the front of `text`.
std::size_t exponent_at(std::string_view text, Exponents taken) {
    if (text.empty() || (text[0] != 'e' && text[0] != 'E')) return 0;
    std::size_t at = 1;
    const char sign = at < text.size() && (text[at] == '+' || text[at] == '-') ? text[at++] : ' ';
    const std::size_t digits = at;
    while (at < text.size() && is_digit(text[at])) ++at;
    if (at == digits || (at < text.size() && text[at] == '.')) return 0;
    const bool certain = sign == '+' || (sign == '-' && text[digits] == '0' && at - digits >= 2);
    return taken == Exponents::all || (taken == Exponents::certain && certain) ? at : 0;
}

Word take_word(std::string_view& text, Exponents taken = Exponents::all) {
    Word word;
    word.letter = text.front();
    if (word.letter >= 'a' && word.letter <= 'z') word.letter = static_cast<char>(word.letter - 'a' + 'A');
    text.remove_prefix(1);
    skip_blanks(text);
    std::string_view digits = text;
    if (!digits.empty() && digits.front() == '+') digits.remove_prefix(1);
    auto [end, error] =
        std::from_chars(digits.data(), digits.data() + digits.size(), word.number, std::chars_format::fixed);
    if (error != std::errc{}) return word;
    const std::string_view behind = digits.substr(static_cast<std::size_t>(end - digits.data()));
    const std::size_t exponent = is_digit(end[-1]) ? exponent_at(behind, taken) : 0;
    if (exponent != 0) {
        const char* const last = behind.data() + exponent;
        std::from_chars(digits.data(), last, word.number, std::chars_format::scientific);
        end = last;
    }
    word.has_number = true;
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    return word;
}

/// True for the commands, among those that the twin looks at, in which an E may be a word.
bool takes_e(const CommandLine& command) {
    constexpr int kMoves[]{0, 1, 2, 3, 5, 92};
    constexpr int kSettings[]{17, 18, 84, 92, 201, 203, 205};
    return command.letter == 'G' ? std::ranges::find(kMoves, command.number) != std::end(kMoves)
                                 : std::ranges::find(kSettings, command.number) != std::end(kSettings);
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

/// `line` as RS274 reads it: without `( … )`, each a blank, and without what follows a `;` that
/// stands neither in parentheses nor in quotes. `held` keeps it where something is left out.
std::string_view without_comments(std::string_view line, std::string& held) {
    const std::size_t first = line.find_first_of(";(\"");
    if (first == std::string_view::npos || line[first] == ';') return line.substr(0, first);
    bool quoted = false;
    int depth = 0;
    held.clear();
    for (const char c : line) {
        if (c == ';' && !quoted && depth == 0) break;
        if (c == '"' && depth == 0) quoted = !quoted;
        if (depth == 0 && (c != '(' || quoted)) held += c;
        if (quoted) continue;
        if (c == '(' && depth == 0) {
            depth = 1;
            held += ' ';
        }
        if (c == ')') depth = 0;
    }
    return held;
}

/// A word's line up to its comment: a `;` in a value that is in double quotes is a part of it.
std::string_view word_without_comment(std::string_view line) {
    std::size_t from = 0;
    for (;;) {
        const std::size_t comment = line.find(';', from);
        const std::size_t value = line.find("=\"", from);
        const std::size_t close = value < comment ? line.find('"', value + 2) : std::string_view::npos;
        if (close == std::string_view::npos) return line.substr(0, comment);
        from = close + 1;
    }
}

/// `N12` in front of a command.
void skip_line_number(std::string_view& line) {
    std::string_view rest = line;
    skip_blanks(rest);
    if (rest.empty() || upper(rest.front()) != 'N') return;
    if (take_word(rest).has_number) line = rest;
}

/// A line whose text is not of words: of a word command, or the name behind M486's A.
bool has_name(std::string_view line) {
    skip_line_number(line);
    skip_blanks(line);
    if (begins_word(line)) return true;
    if (line.empty() || upper(line.front()) != 'M') return false;
    const Word code = take_word(line);
    return code.has_number && code.number == 486;
}

/// `; gcode_flavor = klipper`, `;FLAVOR:RepRap`, `; printer_model = MK3S`: PrusaSlicer and its kin,
/// Cura.
Flavour flavour_of_comment(std::string_view line) {
    skip_blanks(line);
    if (line.empty() || line.front() != ';') return Flavour::marlin;
    line.remove_prefix(1);
    skip_blanks(line);
    while (!line.empty() && (line.back() == ' ' || line.back() == '\t')) line.remove_suffix(1);
    std::string said{line};
    for (char& c : said) c = upper(c);
    if (said == "GCODE_FLAVOR = KLIPPER") return Flavour::klipper;
    if (said == "GCODE_FLAVOR = REPRAPFIRMWARE" || said == "FLAVOR:REPRAP") return Flavour::reprap;
    const std::string_view model = std::string_view{said}.substr(0, 19);
    const bool eight_bits = model == "PRINTER_MODEL = MK2" || model == "PRINTER_MODEL = MK3";
    const std::string_view more = std::string_view{said}.substr(std::min<std::size_t>(said.size(), 19), 2);
    return eight_bits && !(model.back() == '3' && (more == ".5" || more == ".9")) ? Flavour::reprap
                                                                                  : Flavour::marlin;
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

std::optional<std::string_view> CommandLine::word_name(std::string_view key,
                                                       std::initializer_list<std::string_view> others) const {
    // Every ` KEY=` of the tail: where it stands and what it is.
    std::string_view value;
    bool found = false;
    for (std::size_t equals = tail.find('='); equals != std::string::npos;
         equals = tail.find('=', equals + 1)) {
        std::size_t begin = equals;
        while (begin > 0 && tail[begin - 1] != ' ' && tail[begin - 1] != '\t') --begin;
        const std::string_view name = std::string_view{tail}.substr(begin, equals - begin);
        const auto is = [&](std::string_view wanted) {
            return std::ranges::equal(name, wanted, {}, upper, upper);
        };
        if (!found && is(key)) {
            found = true;
            value = std::string_view{tail}.substr(equals + 1);
        } else if (found && std::ranges::any_of(others, is)) {
            value = value.substr(0, static_cast<std::size_t>(tail.data() + begin - value.data()));
            break;
        }
    }
    if (!found) return std::nullopt;
    skip_blanks(value);
    while (!value.empty() && (value.back() == ' ' || value.back() == '\t')) value.remove_suffix(1);
    if (value.size() >= 2 && value.front() == value.back() && (value[0] == '"' || value[0] == '\''))
        value = value.substr(1, value.size() - 2);
    return value;
}

std::optional<double> CommandLine::word_number(std::string_view key) const {
    std::optional<std::string_view> digits = word_value(key);
    if (!digits) return std::nullopt;
    if (!digits->empty() && digits->front() == '+') digits->remove_prefix(1);
    double given = 0;
    const auto [end, error] = std::from_chars(digits->data(), digits->data() + digits->size(), given);
    return error == std::errc{} ? std::optional{given} : std::nullopt;
}

CommandLine LineReader::parse(std::string_view line) {
    CommandLine command;
    command.flavour = flavour_of_comment(line);
    std::string held;
    line = has_name(line) ? word_without_comment(line) : without_comments(line, held);
    if (is_numbered(line)) line = line.substr(0, line.rfind('*'));  // a check sum
    while (!line.empty() && (line.back() == ' ' || line.back() == '\t')) line.remove_suffix(1);
    Exponents exponents = Exponents::all;
    for (skip_blanks(line); !line.empty(); skip_blanks(line)) {
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
        const std::string_view from = line;
        // The number of a code has no exponent: G1E2 is G1 E2.
        const Word word = take_word(line, command.letter == 0 ? Exponents::none : exponents);
        if (command.letter == 0) {
            if (word.letter == 'N' && word.has_number) continue;  // line number
            if ((word.letter != 'G' && word.letter != 'M') || !word.has_number) return command;
            if (!(word.number >= 0 && word.number < kCodeNumberEnd)) return command;
            command.letter = word.letter;
            command.number = static_cast<int>(word.number);
            command.subcode = static_cast<int>(std::lround((word.number - command.number) * 10));
            if (takes_e(command) && is_packed(from)) exponents = Exponents::certain;
            continue;
        }
        const unsigned index = static_cast<unsigned>(word.letter - 'A');
        command.present |= 1u << index;
        if (!word.has_number || !std::isfinite(word.number)) continue;
        command.numbers |= 1u << index;
        command.values[index] = word.number;
    }
    return command;
}

}  // namespace qduino::twin
