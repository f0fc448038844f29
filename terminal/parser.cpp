#include "terminal/parser.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <filesystem>
#include <memory>
#include <optional>
#include <sstream>
#include <utility>
#include <vector>

#include "base/whole_number.h"
#include "terminal/did_you_mean.h"
#include "terminal/message.h"

namespace qduino::apps {
namespace {

/// Wraps lines that are too long; their continuations are indented as the first. Other lines stay.
std::string narrowed(const std::string& text) {
    std::istringstream lines{text};
    std::string out;
    for (std::string line; std::getline(lines, line);) {
        const std::size_t indent = std::min(line.find_first_not_of(' '), line.size());
        out += line.size() <= kColumns ? line + '\n' : wrapped(line.substr(indent), std::string(indent, ' '));
    }
    return out;
}

/// CLI11's help, whose descriptions it does not wrap.
class NarrowHelp final : public CLI::Formatter {
  public:
    std::string make_option(const CLI::Option* option, bool positional) const override {
        return two_columns(make_option_name(option, positional) + make_option_opts(option),
                           make_option_desc(option));
    }
    std::string make_subcommand(const CLI::App* command) const override {
        return two_columns(command->get_display_name(true), command->get_description());
    }
    std::string make_description(const CLI::App* app) const override {
        return narrowed(CLI::Formatter::make_description(app));
    }
    std::string make_usage(const CLI::App* app, std::string name) const override {
        return narrowed(CLI::Formatter::make_usage(app, std::move(name)));
    }
    std::string make_footer(const CLI::App* app) const override {
        return narrowed(CLI::Formatter::make_footer(app));
    }

  private:
    [[nodiscard]] std::string two_columns(const std::string& left, const std::string& right) const {
        const std::string begin = "  " + left;
        if (right.empty()) return begin + '\n';
        const std::string blank(column_width_, ' ');
        if (begin.size() + 1 > column_width_) return begin + '\n' + wrapped(right, blank);
        return wrapped(right, begin + blank.substr(begin.size()));
    }
};

void fit_all(CLI::App& app) {
    auto narrow = std::make_shared<NarrowHelp>();
    narrow->column_width(app.get_formatter()->get_column_width());
    app.formatter(narrow);
    for (CLI::App* command : app.get_subcommands({})) fit_all(*command);
}

/// The command that was named, at whatever depth; else the program itself.
const CLI::App& command_of(const CLI::App& app) {
    const CLI::App* at = &app;
    while (!at->get_subcommands().empty()) at = at->get_subcommands().front();
    return *at;
}

std::string words_before(const CLI::App& command) {
    return command.get_parent() ? words_before(*command.get_parent()) + " " + command.get_name()
                                : command.get_name();
}

std::vector<std::string> options_of(const CLI::App& command) {
    std::vector<std::string> names;
    for (const CLI::Option* option : command.get_options()) {
        for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    }
    return names;
}

std::string see_help(const CLI::App& command, const std::string& meant) {
    return (meant.empty() ? "" : "Did you mean " + meant + "? ") + "'" + words_before(command) +
           " --help' shows what there is.";
}

/// What the line has too much: an option if there is one, else a word. Empty: nothing.
std::string unexpected(const CLI::App& app) {
    const std::vector<std::string> left = app.remaining(true);
    const auto option = std::ranges::find_if(
        left, [](const std::string& word) { return word.size() > 1 && word[0] == '-' && word != "--"; });
    if (option != left.end()) return option->substr(0, option->find('='));
    return left.empty() ? "" : left.front();
}

}  // namespace

namespace {

constexpr double kLargest = 1e9;

/// The number that a word is; nothing when it is none, or goes on behind one.
std::optional<double> number_of(const std::string& word) {
    double value = 0;
    const char* const end = word.data() + word.size();
    const auto [read, error] = std::from_chars(word.data(), end, value);
    if (error != std::errc{} || read != end) return std::nullopt;
    return value;
}

/// In as few digits as tell it: 0.01, 10000.
std::string shortest(double value) {
    std::array<char, 32> text{};
    const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value);
    return {text.data(), end};
}

CLI::Validator number_from(bool zero_is_one, const char* what) {
    const auto wrong = [zero_is_one, what](const std::string& word) {
        const auto value = number_of(word);
        const bool is_number = value && *value <= kLargest;
        const bool good = is_number && (*value > 0 || (zero_is_one && *value == 0));
        return good ? std::string{} : "'" + word + "' is not " + what + ", such as 2.5";
    };
    return {wrong, ""};
}

}  // namespace

CLI::Validator number_within(double least, double most) {
    const auto wrong = [least, most](const std::string& word) {
        const auto value = number_of(word);
        if (value && *value >= least && *value <= most) return std::string{};
        return "'" + word + "' is not a number from " + shortest(least) + " to " + shortest(most);
    };
    return {wrong, ""};
}

CLI::Validator whole_number_within(std::int64_t least, std::int64_t most) {
    const auto wrong = [least, most](const std::string& word) {
        const auto value = whole_number<std::int64_t>(word);
        if (value && *value >= least && *value <= most) return std::string{};
        return "'" + word + "' is not a whole number from " + std::to_string(least) + " to " +
               std::to_string(most);
    };
    return {wrong, ""};
}

CLI::Validator positive_number() { return number_from(false, "a number above 0"); }

CLI::Validator number_not_negative() { return number_from(true, "0 or a number above it"); }

void fit_help(CLI::App& app, const char* program) {
    if (app.get_name().empty()) app.name(std::filesystem::path(program).filename().string());
    fit_all(app);
}

int explain_command_line(const CLI::App& app, const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    const CLI::App& command = command_of(app);
    const std::string prefix = std::filesystem::path(app.get_name()).filename().string() + ": ";
    const std::string word = unexpected(app);
    if (word.empty()) {
        say(error.what(), prefix);
        say(see_help(command, ""));
    } else if (word[0] == '-') {
        say("no such option: " + word, prefix);
        say(see_help(command, nearest(word, options_of(command))));
    } else {
        say("one word too many: " + word, prefix);
        say(see_help(command, ""));
    }
    const bool extra = !word.empty();
    return extra ? static_cast<int>(CLI::ExitCodes::ExtrasError) : error.get_exit_code();
}

int explain_unknown_command(const CLI::App& app, const std::string& word) {
    std::vector<std::string> names;
    for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
    const std::string meant = nearest(word, names);
    say("no such command: " + word, app.get_name() + ": ");
    say(see_help(app, meant.empty() ? "" : "'" + app.get_name() + " " + meant + "'"));
    return static_cast<int>(CLI::ExitCodes::ExtrasError);
}

std::optional<int> parse_command_line(CLI::App& app, int argc, const char* const* argv,
                                      const std::string& typed_as) {
    fit_help(app, argc > 0 ? argv[0] : "");
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() != 0 && !typed_as.empty()) app.name(typed_as);
        return explain_command_line(app, error);
    }
    return std::nullopt;
}

}  // namespace qduino::apps
