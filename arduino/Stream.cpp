#include "arduino/Stream.h"

#include <array>
#include <chrono>
#include <cstdlib>
#include <string_view>

#include "arduino/core/timing.h"
#include "base/text.h"
#include "board/board.h"

namespace board = qduino::board;

namespace {

/// The sleep between two looks at an empty stream.
constexpr qduino::Nanoseconds kLookStep{100'000};

/// Looks again until `look` gives a byte or the timeout has passed.
template <typename Look>
int await_byte(unsigned long timeout_ms, Look look) {
    const qduino::Instant start = board::current().now();
    const auto timeout = std::chrono::milliseconds{static_cast<std::int64_t>(timeout_ms)};
    while (true) {
        const int value = look();
        if (value >= 0) return value;
        const qduino::Instant now = board::current().now();
        if (now - start >= timeout || board::current().stop_requested()) return -1;
        qduino::arduino::wait_until(now + kLookStep);
    }
}

/// Follows one target through a stream of bytes. After a mismatch it falls back to the longest
/// beginning of the target with which the bytes just read still end. A naive search is enough:
/// targets are short.
class Matcher {
  public:
    explicit Matcher(std::string_view target) : target_(target) {}
    /// True when `c` completes the target. An empty target never matches here.
    bool feed(char c) {
        if (target_.empty()) return false;
        while (matched_ > 0 && target_[matched_] != c) matched_ = longest_border(matched_);
        if (target_[matched_] == c) ++matched_;
        if (matched_ < target_.size()) return false;
        matched_ = 0;
        return true;
    }

  private:
    [[nodiscard]] std::size_t longest_border(std::size_t size) const {
        for (std::size_t border = size - 1; border > 0; --border) {
            if (target_.substr(0, border) == target_.substr(size - border, border)) return border;
        }
        return 0;
    }
    std::string_view target_;
    std::size_t matched_ = 0;
};

/// A decimal number as its digits come, as many as they may be: those that count, and how far the
/// point is behind them.
class DecimalNumber {
  public:
    void feed(int digit, bool after_point) {
        if (after_point) --exponent_;
        if (size_ == 0 && digit == 0) return;
        if (size_ == kDigits) {
            ++exponent_;
            return;
        }
        digits_[size_++] = static_cast<char>('0' + digit);
    }
    [[nodiscard]] float value() const {
        if (size_ == 0) return 0;
        qduino::FixedString<kDigits + 24> text;
        qduino::write(text, std::string_view{digits_.data(), size_}, 'e', exponent_, '\0');
        return std::strtof(text.view().data(), nullptr);  // ±infinity or 0 beyond its range
    }

  private:
    static constexpr std::size_t kDigits = 32;  // a float is told apart by 9
    std::array<char, kDigits> digits_{};
    std::size_t size_ = 0;
    std::int64_t exponent_ = 0;
};

}  // namespace

int Stream::timedRead() {
    return await_byte(timeout_ms_, [this] { return read(); });
}
int Stream::timedPeek() {
    return await_byte(timeout_ms_, [this] { return peek(); });
}

bool Stream::findUntil(const char* target, const char* terminator) {
    return findUntil(target, std::strlen(target), terminator, terminator ? std::strlen(terminator) : 0);
}
bool Stream::findUntil(const char* target, std::size_t length, const char* terminator,
                       std::size_t terminator_length) {
    if (length == 0) return true;
    Matcher wanted{{target, length}};
    Matcher stop{terminator ? std::string_view{terminator, terminator_length} : std::string_view{}};
    for (int c; (c = timedRead()) >= 0;) {
        if (wanted.feed(static_cast<char>(c))) return true;
        if (stop.feed(static_cast<char>(c))) return false;
    }
    return false;
}

int Stream::peek_number(LookaheadMode lookahead, bool point_too) {
    while (true) {
        const int c = timedPeek();
        if (c < 0 || c == '-' || (c >= '0' && c <= '9') || (point_too && c == '.')) return c;
        const bool is_white = c == ' ' || c == '\t' || c == '\r' || c == '\n';
        if (lookahead == SKIP_NONE || (lookahead == SKIP_WHITESPACE && !is_white)) return -1;
        read();
    }
}

Stream::Number Stream::parse_number(LookaheadMode lookahead, char ignore, bool point_too) {
    int c = peek_number(lookahead, point_too);
    bool negative = false;
    bool after_point = false;
    // Unsigned, so that too many digits wrap, as on the AVR, and are not undefined.
    unsigned long whole = 0;
    DecimalNumber number;
    for (bool first = true; c >= 0; first = false) {
        const bool is_sign = first && c == '-';
        const bool is_digit = c >= '0' && c <= '9';
        const bool is_point = point_too && c == '.' && !after_point;
        if (!is_sign && !is_digit && !is_point && c != static_cast<unsigned char>(ignore)) break;
        negative = negative || is_sign;
        after_point = after_point || is_point;
        if (is_digit) {
            whole = whole * 10 + static_cast<unsigned long>(c - '0');
            number.feed(c - '0', after_point);
        }
        read();
        c = timedPeek();
    }
    return {static_cast<long>(negative ? 0 - whole : whole), negative ? -number.value() : number.value()};
}

long Stream::parseInt(LookaheadMode lookahead, char ignore) {
    return parse_number(lookahead, ignore, false).whole;
}
float Stream::parseFloat(LookaheadMode lookahead, char ignore) {
    return parse_number(lookahead, ignore, true).real;
}

std::size_t Stream::readBytes(char* buffer, std::size_t length) {
    std::size_t count = 0;
    for (int c; count < length && (c = timedRead()) >= 0;) buffer[count++] = static_cast<char>(c);
    return count;
}

std::size_t Stream::readBytesUntil(char terminator, char* buffer, std::size_t length) {
    std::size_t count = 0;
    for (int c; count < length && (c = timedRead()) >= 0 && static_cast<char>(c) != terminator;) {
        buffer[count++] = static_cast<char>(c);
    }
    return count;
}

String Stream::readString() {
    String text;
    for (int c; (c = timedRead()) >= 0;) text += static_cast<char>(c);
    return text;
}

String Stream::readStringUntil(char terminator) {
    String text;
    for (int c; (c = timedRead()) >= 0 && static_cast<char>(c) != terminator;) text += static_cast<char>(c);
    return text;
}
