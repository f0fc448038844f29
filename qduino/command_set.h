// All commands of `qduino` behind one parser.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "qduino/command.h"

namespace qduino::apps {

class CommandSet {
  public:
    /// With all commands that are linked into the program.
    CommandSet();
    ~CommandSet();
    CommandSet(const CommandSet&) = delete;
    CommandSet& operator=(const CommandSet&) = delete;

    [[nodiscard]] CLI::App& parser() { return *parser_; }
    /// The command that the parser has found, or the one of this name; null: there is none.
    [[nodiscard]] Command* chosen() const { return chosen_; }
    [[nodiscard]] Command* find(const std::string& name) const;
    /// Parses a whole command line and carries out the command. Returns the exit status: 0 and 1,
    /// 2 when admission refuses, above 100 when it was called wrongly, which is said.
    int run(int argc, const char* const* argv);

  private:
    struct Member {
        std::string name;
        std::unique_ptr<Command> command;
    };

    std::unique_ptr<CLI::App> parser_;
    std::vector<Member> members_;
    Command* chosen_ = nullptr;
};

}  // namespace qduino::apps
