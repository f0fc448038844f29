// A program's words to its user: wrapped to 80 columns on a terminal; one line each in a file or a
// pipe, so that they can be searched.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace qduino::apps {

inline constexpr std::size_t kColumns = 80;

/// `words` after `prefix`, broken at spaces; further lines are indented as far as the prefix
/// reaches.
[[nodiscard]] std::string wrapped(std::string_view words, std::string_view prefix);

/// `pieces` with a space between them after `prefix`, broken between pieces alone.
[[nodiscard]] std::string wrapped(const std::vector<std::string>& pieces, std::string_view prefix);

/// The same for a shell command, which stays one that can be copied: broken only outside quotes,
/// with a backslash at each broken end. A command begins with "sudo " or "echo "; other text is
/// wrapped as usual.
[[nodiscard]] std::string wrapped_command(std::string_view words, std::string_view prefix);

/// "PREFIX text" in the form for `descriptor`; ends with a line end. Existing line breaks stay.
[[nodiscard]] std::string message(std::string_view words, std::string_view prefix, int descriptor = 2);
/// Writes it to standard error in one write: other writers' text comes before or after it.
void say(std::string_view words, std::string_view prefix = "");
/// The last line of a command: its result. Its outcome is painted where `colours` are wanted.
[[nodiscard]] std::string verdict(const std::string& words, bool colours);
/// The same for standard error.
[[nodiscard]] std::string verdict(const std::string& words);

}  // namespace qduino::apps
