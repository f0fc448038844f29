// A command of `qduino` is one file in qduino/commands/: its name, its own options, and what it
// does.
//
// The difficulty: an option that only one command has does not belong into a structure of all, and
// a command that stands in a parser, a structure and a table is added in three places. So a command
// is a class whose options are its members, and a static object enters it in the list:
//
//   class Restore final : public Command {
//       void declare(CLI::App& app) override { add_option(app, "--state", state_, …); }
//       Result<int> run() override { … }
//       std::string state_;
//   };
//   const Listed<Restore> restore_listed{{Place::restore, "restore", "Undo what …", "Example: …"}};
//
// The help lists commands in the order of Place, and those of one place by name.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "terminal/program.h"

namespace CLI {
class App;
}

namespace qduino::apps {

/// Says what has failed. Returns the exit status.
inline constexpr Fail say_failed{"qduino: "};

class Command {
  public:
    Command() = default;
    virtual ~Command() = default;
    Command(const Command&) = delete;
    Command& operator=(const Command&) = delete;

    /// Declares the options, on the command's own part of the parser. They are members of the
    /// command, which outlives the parser.
    virtual void declare(CLI::App& app) = 0;
    /// Takes words that the parser must not see, for they may look like options of `qduino`.
    /// `words`: those behind the command's name. Returns how many of them are left to parse, from
    /// the first on. Before the parsing.
    virtual std::size_t take_words(const CLI::App& app, const std::vector<std::string>& words);
    /// Behind the parsing. Returns the exit status: 0, 1 on failure, 2 when admission refuses the
    /// sketch. An error means 1, and its words are said.
    virtual Result<int> run() = 0;
};

/// Where a command stands in the help: sketches first, then computers.
enum class Place {
    make_new,
    build,
    run,
    sim,
    check,
    trace,
    profile,
    vcpu,
    metal,
    lib,
    upload,
    monitor,
    ide,
    doctor,
    restore,
    completion,
    other
};

/// What the help says of a command.
struct CommandWords {
    Place place = Place::other;
    const char* name = "";
    const char* description = "";
    const char* footer = "";  ///< what it does, how it ends, an example
};

struct CommandEntry {
    CommandWords words;
    std::unique_ptr<Command> (*make)() = nullptr;
};

/// All commands that are linked into the program, in the order of the help.
[[nodiscard]] std::vector<CommandEntry> listed_commands();

/// Enters a command in the list.
void list_command(const CommandEntry& entry);

template <typename T>
struct Listed {
    explicit Listed(const CommandWords& words) {
        list_command({words, [] { return std::unique_ptr<Command>(std::make_unique<T>()); }});
    }
};

}  // namespace qduino::apps
