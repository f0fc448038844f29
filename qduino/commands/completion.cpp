// qduino completion: a shell's completion script.
#include "qduino/completion.h"

#include <cstdio>
#include <string>

#include "qduino/command.h"
#include "terminal/parser.h"

namespace qduino::apps {
namespace {

class Completion final : public Command {
    void declare(CLI::App& app) override {
        add_option(app, "shell", shell_, "bash, zsh or fish", "SHELL")
            ->required()
            ->check(CLI::IsMember({"bash", "zsh", "fish"}));
        whole_ = app.get_parent();
    }

    Result<int> run() override {
        std::fputs(completion_script(*whole_, shell_).c_str(), stdout);
        return 0;
    }

    std::string shell_;
    const CLI::App* whole_ = nullptr;  // the parser of all commands
};

const Listed<Completion> completion_listed{
    {Place::completion, "completion", "Print a shell's completion script",
     "bash:    qduino completion bash >\n"
     "           ~/.local/share/bash-completion/completions/qduino\n"
     "zsh:     qduino completion zsh > a folder of $fpath/_qduino\n"
     "fish:    qduino completion fish > ~/.config/fish/completions/qduino.fish\n"
     "Example: source <(qduino completion bash)"}};

}  // namespace
}  // namespace qduino::apps
