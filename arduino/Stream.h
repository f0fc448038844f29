// Stream: can be read as well as printed to, with the parsing that sketches use.
//
// A read that finds nothing sleeps up to the timeout (1 s, or what setTimeout set) of the board's
// time, and consumes no budget. A character that ends a number or a search is left in the stream.
// The exception is the terminator of readStringUntil/readBytesUntil, which is taken and dropped.
#pragma once

#include <cstddef>
#include <cstdint>

#include "arduino/Print.h"

/// The characters that parseInt() and parseFloat() may skip before the number begins.
enum LookaheadMode { SKIP_ALL, SKIP_NONE, SKIP_WHITESPACE };

inline constexpr char NO_IGNORE_CHAR = '\x01';

class Stream : public Print {
  public:
    virtual int available() = 0;
    /// The next byte, or -1; at once.
    virtual int read() = 0;
    virtual int peek() = 0;

    void setTimeout(unsigned long timeout_ms) { timeout_ms_ = timeout_ms; }
    [[nodiscard]] unsigned long getTimeout() const { return timeout_ms_; }

    /// Reads on until `target` was read; false at the timeout.
    bool find(const char* target) { return find(target, std::strlen(target)); }
    bool find(const char* target, std::size_t length) { return findUntil(target, length, nullptr, 0); }
    bool find(char target) { return find(&target, 1); }
    /// The same, but false as soon as `terminator` was read.
    bool findUntil(const char* target, const char* terminator);
    bool findUntil(const char* target, std::size_t length, const char* terminator,
                   std::size_t terminator_length);
    bool find(const std::uint8_t* target) { return find(reinterpret_cast<const char*>(target)); }
    bool find(const std::uint8_t* target, std::size_t length) {
        return find(reinterpret_cast<const char*>(target), length);
    }

    /// The next whole number; 0 when none came in time. `ignore` may stand between its digits (a
    /// thousands separator).
    qduino::arduino::Long parseInt(LookaheadMode lookahead = SKIP_ALL, char ignore = NO_IGNORE_CHAR);
    float parseFloat(LookaheadMode lookahead = SKIP_ALL, char ignore = NO_IGNORE_CHAR);

    /// Up to `length` bytes; returns how many came in time.
    std::size_t readBytes(char* buffer, std::size_t length);
    std::size_t readBytes(std::uint8_t* buffer, std::size_t length) {
        return readBytes(reinterpret_cast<char*>(buffer), length);
    }
    std::size_t readBytesUntil(char terminator, char* buffer, std::size_t length);
    std::size_t readBytesUntil(char terminator, std::uint8_t* buffer, std::size_t length) {
        return readBytesUntil(terminator, reinterpret_cast<char*>(buffer), length);
    }
    String readString();
    String readStringUntil(char terminator);

  protected:
    int timedRead();
    int timedPeek();

  private:
    /// The next byte that may begin a number (left in the stream), or -1.
    int peek_number(LookaheadMode lookahead, bool point_too);
    /// A number read both ways: `whole` has all its digits, `real` has the point.
    struct Number {
        long whole = 0;
        float real = 0;
    };
    /// Digits, with at most one point if `point_too`; zeroes when none came.
    Number parse_number(LookaheadMode lookahead, char ignore, bool point_too);

    unsigned long timeout_ms_ = 1000;
};

namespace arduino {
using ::Stream;
}  // namespace arduino
