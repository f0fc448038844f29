// A program's messages to its user, on standard error: wrapped on a terminal; one line each in a
// file or a pipe, so that they can be searched.
#pragma once

#include <string>
#include <string_view>

namespace qduino::apps {

/// "PREFIX text" in the form for `descriptor`; ends with a line end. Existing line breaks stay.
[[nodiscard]] std::string message(std::string_view text, std::string_view prefix, int descriptor = 2);
/// Writes it in one write: other writers' text comes before or after it.
void say(std::string_view text, std::string_view prefix = "");
/// The last line of a command: its result.
[[nodiscard]] inline std::string verdict(const std::string& text) { return "Verdict: " + text + "\n"; }

}  // namespace qduino::apps
