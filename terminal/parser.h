// Our help and our words around CLI11's parser: help that fits 80 columns, and errors that guess
// what was meant. For a program with commands (qduino); others take CommandLine (command_line.h),
// which spares their compiler CLI11.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>

namespace qduino::apps {

/// An option whose help calls its value `argument`: "--for S".
template <typename Value>
CLI::Option* add_option(CLI::App& app, const char* names, Value& value, const char* description,
                        const char* argument) {
    return app.add_option(names, value, description)->option_text(argument);
}

/// What is no number above 0 (of seconds, and so on; a thousand million at most) is refused by
/// words.
[[nodiscard]] CLI::Validator positive_number();
/// The same, and 0 is one.
[[nodiscard]] CLI::Validator number_not_negative();

/// A number, or a whole one, from `least` to `most`; anything else is refused by words.
[[nodiscard]] CLI::Validator number_within(double least, double most);
[[nodiscard]] CLI::Validator whole_number_within(std::int64_t least, std::int64_t most);

/// Parses. A returned value is the exit status to leave with: help was printed, or the line was
/// wrong and the user was told.
/// `typed_as`: what the user has typed, where that is not this program.
std::optional<int> parse_command_line(CLI::App& app, int argc, const char* const* argv,
                                      const std::string& typed_as = "");

/// Its first half, for a program that shows its help unasked: help that fits.
void fit_help(CLI::App& app, const char* program);
/// Its second half: the words for a wrong line, or the help that was asked for. Returns the exit
/// status: 0, or above 100.
int explain_command_line(const CLI::App& app, const CLI::ParseError& error);

/// For a command that does not exist: says so, and guesses which was meant. Returns the exit
/// status.
int explain_unknown_command(const CLI::App& app, const std::string& word);

}  // namespace qduino::apps
