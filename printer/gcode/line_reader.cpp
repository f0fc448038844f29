#include "printer/gcode/line_reader.h"

#include <algorithm>
#include <cstring>

#include "printer/gcode/command_table.h"
#include "printer/gcode/lexer.h"
#include "printer/gcode/text.h"

namespace qduino::printer::gcode {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

/// Index of the first LF or CR, or the size. In steps, so that a file without any LF is not
/// searched to its end for each of its lines.
std::size_t find_line_end(std::span<const char> bytes) {
    constexpr std::size_t kStep = 256;
    for (std::size_t begin = 0; begin < bytes.size(); begin += kStep) {
        const char* const first = bytes.data() + begin;
        const std::size_t size = std::min(kStep, bytes.size() - begin);
        const auto find = [&](char c, std::size_t count) {
            const void* const found = std::memchr(first, c, count);
            return found ? static_cast<std::size_t>(static_cast<const char*>(found) - first) : count;
        };
        const std::size_t end = find('\r', find('\n', size));
        if (end < size) return begin + end;
    }
    return bytes.size();
}

/// No host counts further; so the next number never wraps.
constexpr std::uint64_t kLineNumberMax = std::uint64_t{1} << 62;

/// Takes `N123` or `N-1` off the front.
std::optional<std::int64_t> take_line_number(std::string_view& code) {
    std::string_view rest = trim(code);
    if (rest.empty() || to_upper(rest.front()) != 'N') return std::nullopt;
    rest.remove_prefix(1);
    while (!rest.empty() && is_space(rest.front())) rest.remove_prefix(1);
    const bool negative = !rest.empty() && rest.front() == '-';
    if (negative) rest.remove_prefix(1);
    const auto size = take_integer(rest);
    if (!size || *size > kLineNumberMax) return std::nullopt;
    code = rest;
    const auto number = static_cast<std::int64_t>(*size);
    return negative ? -number : number;
}

/// Takes `*57` off the end of `code`, whose first byte is the line's first. Marlin's sum: the
/// exclusive or of all bytes before the last `*`.
Checksum take_checksum(std::string_view& code) {
    const std::size_t star = code.rfind('*');
    if (star == std::string_view::npos) return Checksum::absent;
    std::string_view digits = trim(code.substr(star + 1));
    code = code.substr(0, star);
    unsigned char sum = 0;
    for (const char c : code) sum = static_cast<unsigned char>(sum ^ static_cast<unsigned char>(c));
    const auto value = take_integer(digits);
    return value == sum && digits.empty() ? Checksum::right : Checksum::wrong;
}

/// A line whose tail need not be words: there, quotes and parentheses are characters like others.
bool has_free_text(std::string_view line) {
    take_line_number(line);
    line = trim(line);
    const LeadingCode code = leading_code(line);
    const bool is_lone_speed = to_upper(code.letter) == 'F' || to_upper(code.letter) == 'S';
    if (is_lone_speed) return false;
    return is_word_command(line) || (code.letter != '\0' && !must_be_words(code.letter, code.number));
}

bool is_word_line(std::string_view line) {
    take_line_number(line);
    return is_word_command(trim(line));
}

/// As find_first_of, but a plain loop: the library's makes a call for every character.
bool contains_either(std::string_view text, char a, char b) {
    return std::any_of(text.begin(), text.end(), [=](char c) { return c == a || c == b; });
}

/// True when `text` is letters, digits, signs, points and blanks alone, as nearly every line of a
/// job is: no comment, no quote, no parenthesis, no check sum.
bool is_plain(std::string_view text) {
    static constexpr auto kPlain = [] {
        std::array<bool, 256> plain{};
        for (int c = 0; c < 256; ++c)
            plain[static_cast<std::size_t>(c)] = is_letter(static_cast<char>(c)) || (c >= '0' && c <= '9');
        for (const char c : {' ', '\t', '.', '-', '+'}) plain[static_cast<unsigned char>(c)] = true;
        return plain;
    }();
    bool plain = true;
    for (const char c : text) plain = plain && kPlain[static_cast<unsigned char>(c)];
    return plain;
}

/// A word command: `NAME="a;b"`. In a value in quotes a `;` is a character. A quote elsewhere
/// hides nothing: names hold inches.
std::size_t find_comment_of_word(std::string_view line) {
    bool in_quotes = false;
    for (std::size_t i = 0; i < line.size(); ++i) {
        if (line[i] == ';' && !in_quotes) return i;
        const bool opens =
            line[i] == '"' && i > 0 && line[i - 1] == '=' && line.find('"', i + 1) != std::string_view::npos;
        in_quotes = line[i] == '"' ? opens : in_quotes;
    }
    return line.size();
}

/// Where the `;` comment begins, or the size. Quotes and parentheses hide a `;`, but in free text.
std::size_t find_comment(std::string_view line) {
    const std::size_t first = std::min(line.find(';'), line.size());
    const bool can_be_hidden = contains_either(line.substr(0, first), '"', '(');
    if (!can_be_hidden) return first;
    if (has_free_text(line)) return is_word_line(line) ? find_comment_of_word(line) : first;
    bool in_quotes = false;
    bool in_parentheses = false;
    for (std::size_t i = 0; i < line.size(); ++i) {
        const char c = line[i];
        if (c == ';' && !in_quotes && !in_parentheses) return i;
        if (c == '"' && !in_parentheses) in_quotes = !in_quotes;
        if (c == '(' && !in_quotes) in_parentheses = true;
        if (c == ')' && !in_quotes) in_parentheses = false;
    }
    return line.size();
}

}  // namespace

Error at_place(const Error& error, const Source& source) {
    return make_error(error.code, "line ", source.line, ", byte ", source.offset, ": ", error.message);
}

void LineReader::reset(std::uint64_t offset, std::uint64_t lines) {
    *this = LineReader{};
    offset_ = line_offset_ = offset;
    lines_ = lines;
}

bool LineReader::next(std::span<const char>& input, RawLine& line) {
    if (after_cr_ && !input.empty()) {
        after_cr_ = false;
        if (input.front() == '\n') {
            input = input.subspan(1);
            line_offset_ = ++offset_;
        }
    }
    const std::size_t end = find_line_end(input);
    take(input.first(end));
    if (end == input.size()) {
        input = {};
        return false;
    }
    after_cr_ = input[end] == '\r';
    ++offset_;
    input = input.subspan(end + 1);
    deliver(line);
    return true;
}

bool LineReader::finish(RawLine& line) {
    if (line_length_ == 0) return false;
    deliver(line);
    return true;
}

void LineReader::take(std::span<const char> piece) {
    if (piece.empty()) return;
    const std::size_t room = held_.size() - held_count_;
    const std::size_t count = std::min(room, piece.size());
    std::memcpy(held_.data() + held_count_, piece.data(), count);
    held_count_ += count;
    if (first_nul_ == kNone) {
        if (const void* nul = std::memchr(piece.data(), 0, piece.size())) {
            first_nul_ = offset_ + static_cast<std::uint64_t>(static_cast<const char*>(nul) - piece.data());
        }
    }
    line_length_ += piece.size();
    offset_ += piece.size();
}

void LineReader::deliver(RawLine& line) {
    line.text = {held_.data(), held_count_};
    line.code = line.comment = {};
    line.comment_cut = false;
    line.frame = {};
    line.source = {line_offset_, offset_, ++lines_, line_length_};
    line.error = split(line);
    if (line.error) {
        line.code = {};
        line.error = at_place(*line.error, line.source);
    }
    held_count_ = 0;
    line_length_ = 0;
    line_offset_ = offset_;
    first_nul_ = kNone;
}

std::optional<Error> LineReader::split(RawLine& line) {
    if (first_nul_ != kNone) {
        return make_error(ErrorCode::invalid_argument, "a NUL byte at ", first_nul_,
                          ": a text holds none. The file was not written to its end, or is no text");
    }
    std::string_view held{held_.data(), held_count_};
    if (line.source.offset == 0 && line.source.line == 1) skip_prefix(held, kByteOrderMark);
    if (line_length_ <= kCommandBytesMax && is_plain(held)) {
        line.code = trim(held);
        if (line.code.empty() || to_upper(line.code.front()) != 'N') return std::nullopt;
    }
    const bool overflowed = line_length_ > kLineBytesMax;
    const std::size_t comment_at = find_comment(held);
    if (comment_at < held.size()) {
        line.comment = held.substr(comment_at + 1);
        line.comment_cut = overflowed;
    }
    line.code = held.substr(0, comment_at);
    const bool code_overflowed = overflowed && comment_at == held.size();

    std::string_view framed = line.code;
    line.frame.number = take_line_number(framed);
    if (line.frame.number) {
        line.frame.checksum = take_checksum(line.code);
        framed = line.code;
        take_line_number(framed);
        line.code = framed;
    }
    line.code = trim(line.code);
    const bool is_word = is_word_command(line.code);
    const std::size_t code_max = is_word ? kLineBytesMax : kCommandBytesMax;
    const LeadingCode code = leading_code(line.code);
    const bool may_be_cut = (is_word && is_known_word(leading_word(line.code))) ||
                            (!is_word && takes_free_text(code.letter, code.number));
    if (!may_be_cut && (code_overflowed || line.code.size() > code_max)) {
        return make_error(ErrorCode::invalid_argument, "the command is ",
                          code_overflowed ? line_length_ : line.code.size(), " bytes long, more than the ",
                          code_max, " that a command may have");
    }
    if (line.frame.checksum == Checksum::wrong) {
        return make_error(ErrorCode::corrupt, "the check sum behind * is not that of the line");
    }
    return remove_parentheses(line);
}

std::optional<Error> LineReader::remove_parentheses(RawLine& line) {
    if (!contains_either(line.code, '(', ')') || has_free_text(line.code)) return std::nullopt;
    std::size_t count = 0;
    bool in_quotes = false;
    bool in_parentheses = false;
    for (const char c : line.code) {
        if (in_parentheses) {
            in_parentheses = c != ')';
            continue;
        }
        if (c == '"') in_quotes = !in_quotes;
        in_parentheses = c == '(' && !in_quotes;
        if (c == ')' && !in_quotes) return make_error(ErrorCode::invalid_argument, "a ) without its (");
        code_[count++] = in_parentheses ? ' ' : c;
    }
    if (in_parentheses) return make_error(ErrorCode::invalid_argument, "a ( without its )");
    line.code = trim({code_.data(), count});
    return std::nullopt;
}

}  // namespace qduino::printer::gcode
