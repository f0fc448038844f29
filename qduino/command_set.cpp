#include "qduino/command_set.h"

#include <algorithm>
#include <cstdio>
#include <string_view>
#include <utility>

#include "base/version.h"
#include "terminal/message.h"
#include "terminal/parser.h"
#include "terminal/program.h"

namespace qduino::apps {
namespace {

// Descriptions fit their column: with 28 columns to the left, a line of 80 has 52 for them. (A test
// measures every page.)
constexpr std::size_t kColumn = 28;

std::vector<CommandEntry>& list() {
    static std::vector<CommandEntry> entries;
    return entries;
}

}  // namespace

std::size_t Command::take_words(const CLI::App&, const std::vector<std::string>& words) {
    return words.size();
}

void list_command(const CommandEntry& entry) { list().push_back(entry); }

std::vector<CommandEntry> listed_commands() {
    std::vector<CommandEntry> entries = list();
    std::ranges::sort(entries, {}, [](const CommandEntry& entry) {
        return std::pair{entry.words.place, std::string_view{entry.words.name}};
    });
    return entries;
}

CommandSet::CommandSet()
    : parser_(std::make_unique<CLI::App>(
          "Sketches with several loops, each with a budget, a period and a core.", "qduino")) {
    parser_->footer(
        "Example: qduino new blinker && cd blinker && qduino check && qduino run\n"
        "'qduino help COMMAND' says more. Ends with 0 when all is well, 1 on failure, 2\n"
        "when admission refuses the sketch, above 100 when it was called wrongly.");
    parser_->get_formatter()->column_width(kColumn);
    parser_->set_version_flag("--version", std::string("qduino ").append(version()), "Print the version");
    parser_->require_subcommand(1);
    for (const auto& [words, make] : listed_commands()) {
        members_.push_back({words.name, make()});
        Command* const command = members_.back().command.get();
        CLI::App* const app = parser_->add_subcommand(words.name, words.description);
        app->footer(words.footer);
        app->get_formatter()->column_width(kColumn);
        app->parse_complete_callback([this, command] { chosen_ = command; });
        command->declare(*app);
    }
}

CommandSet::~CommandSet() = default;

Command* CommandSet::find(const std::string& name) const {
    const auto found = std::ranges::find(members_, name, &Member::name);
    return found == members_.end() ? nullptr : found->command.get();
}

int CommandSet::run(int argc, const char* const* argv) {
    if (argc <= 1) {  // nothing went wrong
        fit_help(*parser_, "qduino");
        std::fputs(parser_->help().c_str(), stdout);
        return 0;
    }
    const auto is_unknown = [this](const char* word) { return word[0] != '-' && !find(word); };
    // 'qduino help sim' is 'qduino sim --help'.
    if (argv[1] == std::string_view{"help"}) {
        const char* const asked[] = {argv[0], argc > 2 ? argv[2] : "--help", "--help"};
        if (argc > 2 && is_unknown(argv[2])) return explain_unknown_command(*parser_, argv[2]);
        return parse_command_line(*parser_, argc > 2 ? 3 : 2, asked).value_or(0);
    }
    if (is_unknown(argv[1])) return explain_unknown_command(*parser_, argv[1]);
    int count = argc;
    if (Command* const command = find(argv[1])) {
        const std::vector<std::string> words(argv + 2, argv + argc);
        count = 2 + static_cast<int>(command->take_words(*parser_->get_subcommand(argv[1]), words));
    }
    if (const auto status = parse_command_line(*parser_, count, argv)) return *status;
    const Result<int> status = chosen_->run();
    return status ? *status : say_failed(status.error());
}

}  // namespace qduino::apps
