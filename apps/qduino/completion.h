// Completion scripts for shells, made from the parser itself, so that they have its options.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace qduino::apps {

/// `shell` is "bash", "zsh" or "fish"; anything else gives an empty text.
[[nodiscard]] std::string completion_script(const CLI::App& parser, const std::string& shell);

}  // namespace qduino::apps
