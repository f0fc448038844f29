// Serial of a sketch as a person reads it in a terminal: lines, with the time in front of each when
// that is wanted; and what a person types, with the line end that the sketch wants.
#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace qduino::apps {

class MonitorText {
  public:
    /// `clock` gives the text in front of a line, called at its first byte; empty function: none.
    explicit MonitorText(std::function<std::string()> clock) : clock_(std::move(clock)) {}

    /// `bytes` as they are to be shown: "\r\n" and a lone "\r" before the next line are "\n".
    [[nodiscard]] std::string shown(std::string_view bytes);
    /// True within a line.
    [[nodiscard]] bool in_line() const { return in_line_; }

  private:
    std::function<std::string()> clock_;
    bool in_line_ = false;
    bool returned_ = false;  // the last byte was '\r'
};

/// "13:05:59.042 -> ", the computer's local time.
[[nodiscard]] std::string time_before_line();

/// What the Arduino IDE calls its line ends: "none", "nl", "cr" or "crlf". Contract: one of these.
[[nodiscard]] std::string_view line_end_of(std::string_view name);

/// `typed` with `line_end` in the place of each '\n'.
[[nodiscard]] std::string with_line_ends(std::string_view typed, std::string_view line_end);

}  // namespace qduino::apps
