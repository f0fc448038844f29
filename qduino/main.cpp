// qduino: makes, builds, checks, simulates, traces and runs sketches, and looks after the computer
// that they run on. Without arguments it lists its commands and returns 0: nothing went wrong.
#include <algorithm>
#include <cstdio>
#include <string_view>

#include "qduino/arguments.h"
#include "terminal/parser.h"
#include "terminal/program.h"

namespace {

/// The parser alone would only complain that a command is missing.
bool is_unknown_command(const CLI::App& parser, const char* word) {
    const auto is_it = [word](const CLI::App* command) { return command->get_name() == word; };
    return word[0] != '-' && std::ranges::none_of(parser.get_subcommands({}), is_it);
}

}  // namespace

int main(int argc, char** argv) {
    qduino::apps::keep_standard_descriptors();
    qduino::apps::Arguments arguments;
    const auto parser = qduino::apps::make_parser(arguments);
    if (argc <= 1) {
        qduino::apps::fit_help(*parser, "qduino");
        std::fputs(parser->help().c_str(), stdout);
        return 0;
    }
    // 'qduino help sim' is 'qduino sim --help'.
    if (argv[1] == std::string_view{"help"}) {
        const char* const asked[] = {argv[0], argc > 2 ? argv[2] : "--help", "--help"};
        if (argc > 2 && is_unknown_command(*parser, argv[2]))
            return qduino::apps::explain_unknown_command(*parser, argv[2]);
        return qduino::apps::parse_command_line(*parser, argc > 2 ? 3 : 2, asked).value_or(0);
    }
    if (is_unknown_command(*parser, argv[1])) return qduino::apps::explain_unknown_command(*parser, argv[1]);
    const int count = qduino::apps::take_program(*parser, arguments, argc, argv);
    if (const auto status = qduino::apps::parse_command_line(*parser, count, argv)) return *status;
    return qduino::apps::run_command(arguments, *parser);
}
