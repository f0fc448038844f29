// Completion scripts of a parser for the usual shells.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace qduino::apps {

/// The completion script of `parser` for a shell, "bash", "zsh" or "fish"; anything else gives an
/// empty text.
[[nodiscard]] std::string completion_script(const CLI::App& parser, const std::string& shell);

}  // namespace qduino::apps
