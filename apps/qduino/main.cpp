// qduino: makes, builds, checks, simulates, traces and runs sketches; looks after the machine that they run
// on.
#include <cstdio>

#include "apps/qduino/arguments.h"
#include "apps/qduino/commands.h"

namespace {

/// The parser would say no more than that a command is missing.
bool is_unknown_command(const CLI::App& parser, const char* word) {
    if (word[0] == '-') return false;
    for (const CLI::App* command : parser.get_subcommands({})) {
        if (command->get_name() == word) return false;
    }
    return true;
}

}  // namespace

int main(int argc, char** argv) {
    qduino::apps::Arguments arguments;
    const auto parser = qduino::apps::make_parser(arguments);
    if (argc > 1 && is_unknown_command(*parser, argv[1])) {
        std::fprintf(stderr,
                     "qduino: no such command: %s\nRun with --help for the commands that there are.\n",
                     argv[1]);
        return static_cast<int>(CLI::ExitCodes::ExtrasError);
    }
    CLI11_PARSE(*parser, argc, argv);
    return qduino::apps::run_command(arguments, *parser);
}
