// What a program says to its user, on standard error: wrapped where that is a terminal, each message one line where it is a file or a
// pipe, so that it can be searched.
#pragma once

#include <string>
#include <string_view>

namespace qduino::apps {

/// "PREFIX text" as said to `descriptor`; ends with a line end. Lines that are there stay.
[[nodiscard]] std::string message(std::string_view text, std::string_view prefix, int descriptor = 2);
/// Says it, in one write: what others write meanwhile comes before or after it.
void say(std::string_view text, std::string_view prefix = "");
/// The last line of a command: what came of it.
[[nodiscard]] inline std::string verdict(const std::string& text) { return "Verdict: " + text + "\n"; }

}  // namespace qduino::apps
