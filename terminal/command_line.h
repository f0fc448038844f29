// The command line of a program: help that fits 80 columns, and errors that guess what was meant.
//
//   CommandLine line{"Plays the printer."};
//   line.option("--fifo", priority, "SCHED_FIFO priority").within(0, 98).shows_default();
//   if (const auto status = line.parse(argc, argv)) return *status;
//
//   $ virtual-machine --fifo 200
//   virtual-machine: --fifo: '200' is not a whole number from 0 to 98
//   'virtual-machine --help' shows what there is.
//
// CLI11 parses. Its headers take the compiler three seconds, so one file includes them for all
// programs.
#pragma once

#include <concepts>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace qduino::apps {

template <typename T, typename... Ts>
concept IsOneOf = (std::same_as<T, Ts> || ...);

/// What the value of an option may be.
template <typename T>
concept OptionValue = IsOneOf < T,
        std::string, std::filesystem::path, std::vector<std::string>,
int, std::uint16_t, std::int64_t, std::uint64_t, double, std::optional<double>, std::optional<int>,
    std::optional < std::uint64_t >>
    ;

class CommandLine {
  public:
    /// What is said of an option or flag behind its declaration. Lives as long as its line.
    class Option {
      public:
        Option& required();
        Option& needs(const Option& other);
        Option& shows_default();               ///< the help tells the value's present content
        Option& called(const char* argument);  ///< the help's word for its value: "--for S"
        Option& within(int least, int most);   ///< both inclusive, as below
        Option& within(double least, double most);
        Option& not_negative();
        Option& positive();
        Option& existing_file();
        Option& one_of(std::vector<std::string> words);
        /// `wrong` gives what is wrong with the value's text; empty: nothing.
        Option& check(std::function<std::string(const std::string& text)> wrong);

      private:
        friend class CommandLine;
        explicit Option(void* option) : option_(option) {}
        void* option_;  ///< a CLI::Option of the line
    };

    /// `footer`: examples, exit statuses; printed at the end of the help.
    explicit CommandLine(const std::string& description, const std::string& footer = "");
    ~CommandLine();
    CommandLine(const CommandLine&) = delete;
    CommandLine& operator=(const CommandLine&) = delete;

    /// What the program calls itself, where that is not the name of its file.
    void name(const std::string& name);
    /// What was typed to start this program, "./run": its words are about that, and not about a
    /// program that its user does not know.
    void typed_as(const std::string& command) { typed_as_ = command; }
    /// `names`: "--state", or "FILE" for a word without an option. `value` outlives the parsing;
    /// what it holds is the default.
    template <OptionValue Value>
    Option option(const char* names, Value& value, const char* description);
    /// "!--no-auth" sets `value` to false.
    Option flag(const char* names, bool& value, const char* description);

    /// Parses. A returned value is the exit status to leave with: 0 when help was printed, above
    /// 100 when the line was wrong and the user was told.
    [[nodiscard]] std::optional<int> parse(int argc, const char* const* argv);
    /// After the parsing: says what is wrong with what was given together. Returns such a status.
    [[nodiscard]] int refuse(const std::string& wrong) const;

  private:
    struct Parser;
    std::unique_ptr<Parser> parser_;
    std::string typed_as_;
};

}  // namespace qduino::apps
