#include "terminal/command_line.h"

#include <utility>

#include "terminal/parser.h"

namespace qduino::apps {
namespace {

CLI::Option& of(void* option) { return *static_cast<CLI::Option*>(option); }

}  // namespace

struct CommandLine::Parser {
    CLI::App app;
};

CommandLine::CommandLine(const std::string& description, const std::string& footer)
    : parser_(new Parser{CLI::App{description}}) {
    parser_->app.footer(footer);
}

CommandLine::~CommandLine() = default;

void CommandLine::name(const std::string& name) { parser_->app.name(name); }

template <OptionValue Value>
CommandLine::Option CommandLine::option(const char* names, Value& value, const char* description) {
    return Option{parser_->app.add_option(names, value, description)};
}

template CommandLine::Option CommandLine::option(const char*, std::string&, const char*);
template CommandLine::Option CommandLine::option(const char*, std::filesystem::path&, const char*);
template CommandLine::Option CommandLine::option(const char*, std::vector<std::string>&, const char*);
template CommandLine::Option CommandLine::option(const char*, int&, const char*);
template CommandLine::Option CommandLine::option(const char*, std::uint16_t&, const char*);
template CommandLine::Option CommandLine::option(const char*, std::int64_t&, const char*);
template CommandLine::Option CommandLine::option(const char*, std::uint64_t&, const char*);
template CommandLine::Option CommandLine::option(const char*, double&, const char*);
template CommandLine::Option CommandLine::option(const char*, std::optional<double>&, const char*);
template CommandLine::Option CommandLine::option(const char*, std::optional<int>&, const char*);
template CommandLine::Option CommandLine::option(const char*, std::optional<std::uint64_t>&, const char*);

CommandLine::Option CommandLine::flag(const char* names, bool& value, const char* description) {
    return Option{parser_->app.add_flag(names, value, description)};
}

std::optional<int> CommandLine::parse(int argc, const char* const* argv) {
    return parse_command_line(parser_->app, argc, argv, typed_as_);
}

int CommandLine::refuse(const std::string& wrong) const {
    if (!typed_as_.empty()) parser_->app.name(typed_as_);
    return explain_command_line(parser_->app, CLI::ParseError{wrong, CLI::ExitCodes::ValidationError});
}

CommandLine::Option& CommandLine::Option::required() {
    of(option_).required();
    return *this;
}

CommandLine::Option& CommandLine::Option::needs(const Option& other) {
    of(option_).needs(&of(other.option_));
    return *this;
}

CommandLine::Option& CommandLine::Option::shows_default() {
    of(option_).capture_default_str();
    return *this;
}

CommandLine::Option& CommandLine::Option::called(const char* argument) {
    of(option_).option_text(argument);
    return *this;
}

CommandLine::Option& CommandLine::Option::within(int least, int most) {
    of(option_).check(whole_number_within(least, most));
    return *this;
}

CommandLine::Option& CommandLine::Option::within(double least, double most) {
    of(option_).check(number_within(least, most));
    return *this;
}

CommandLine::Option& CommandLine::Option::not_negative() {
    of(option_).check(number_not_negative());
    return *this;
}

CommandLine::Option& CommandLine::Option::positive() {
    of(option_).check(positive_number());
    return *this;
}

CommandLine::Option& CommandLine::Option::existing_file() {
    of(option_).check(CLI::ExistingFile);
    return *this;
}

CommandLine::Option& CommandLine::Option::one_of(std::vector<std::string> words) {
    of(option_).check(CLI::IsMember(std::move(words)));
    return *this;
}

CommandLine::Option& CommandLine::Option::check(std::function<std::string(const std::string& text)> wrong) {
    of(option_).check(std::move(wrong));
    return *this;
}

}  // namespace qduino::apps
