// The command line of every program: help that fits 80 columns, and errors that guess what was
// meant.
//
//   $ qduino sim --fro 5
//   qduino: no such option: --fro
//   Did you mean --for? 'qduino sim --help' shows what there is.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace qduino::apps {

/// An option whose help calls its value `argument`: "--for S".
template <typename Value>
CLI::Option* add_option(CLI::App& app, const char* names, Value& value, const char* description,
                        const char* argument) {
    return app.add_option(names, value, description)->option_text(argument);
}

/// Parses. A returned value is the exit status to leave with: help was printed, or the line was
/// wrong and the user was told.
std::optional<int> parse_command_line(CLI::App& app, int argc, const char* const* argv);

/// Its two halves, for a program that does something between them: help that fits …
void fit_help(CLI::App& app, const char* program);
/// … and the words for a wrong line, or the help that was asked for. Returns the exit status: 0, or
/// above 100.
int explain_command_line(const CLI::App& app, const CLI::ParseError& error);

/// For a command that does not exist: says so, and guesses which was meant. Returns the exit
/// status.
int explain_unknown_command(const CLI::App& app, const std::string& word);

/// Letters to be added, left out, exchanged, or swapped with their neighbour to make `b` of `a`:
/// the optimal string alignment distance (Damerau, 1964, each place edited once).
[[nodiscard]] int edit_distance(std::string_view a, std::string_view b);

/// The nearest of `known`: with at most one slip for each three letters, or the only one that
/// begins with `word`. Empty: none.
[[nodiscard]] std::string nearest(std::string_view word, std::span<const std::string> known);

}  // namespace qduino::apps
