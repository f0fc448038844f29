// What all programs' command lines have in common: help that fits 80 columns, and an error that says what was meant.
//
//   $ qduino sim --fro 5
//   qduino: no such option: --fro
//   Did you mean --for? 'qduino sim --help' shows what there is.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

namespace qduino::apps {

/// Parses. A value: leave with it (help was printed, or the line is wrong and that was said).
std::optional<int> parse_command_line(CLI::App& app, int argc, const char* const* argv);

/// Its two halves, for a program that does something between them: help that fits …
void fit_help(CLI::App& app, const char* program);
/// … and what is said of a wrong line, or the help that was asked for. Returns the exit status: 0, or above 100.
int explain_command_line(const CLI::App& app, const CLI::ParseError& error);

/// For a command that is none: says so, and which was meant. Returns the exit status.
int explain_unknown_command(const CLI::App& app, const std::string& word);

}  // namespace qduino::apps
