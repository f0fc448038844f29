// Text for a terminal of 80 columns.
#pragma once

#include <string>
#include <string_view>

namespace qduino::apps {

inline constexpr std::size_t kColumns = 80;

/// `text` after `prefix`, broken at spaces; further lines are indented as far as the prefix
/// reaches.
std::string wrapped(std::string_view text, std::string_view prefix);

/// The same for a shell command, which stays one that can be copied: broken only outside quotes,
/// with a backslash at each broken end. A command begins with "sudo " or "echo "; other text is
/// wrapped as usual.
std::string wrapped_command(std::string_view text, std::string_view prefix);

}  // namespace qduino::apps
