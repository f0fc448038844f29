// qduino restore: undoes what a dead sketch left changed.
#include <cstdio>
#include <string>

#include "board/linux/kernel/host_settings.h"
#include "qduino/command.h"
#include "terminal/parser.h"

namespace qduino::apps {
namespace {

class Restore final : public Command {
    void declare(CLI::App& app) override {
        add_option(app, "--state", state_, "Where changes are written down", "FILE");
    }

    Result<int> run() override {
        QDUINO_TRY_ASSIGN(const auto restored, board::linux::restore_settings(state_));
        std::printf(restored == board::linux::Restored::undone
                        ? "What a dead sketch had changed on this computer is as it was before.\n"
                        : "Nothing to undo: no sketch has left this computer changed.\n");
        return 0;
    }

    std::string state_ = board::linux::kDefaultSettingsState;
};

const Listed<Restore> restore_listed{
    {Place::restore, "restore", "Undo what a dead sketch left changed",
     "A sketch that isolates cores writes each change to the computer down before\n"
     "it makes it. This undoes what a killed one could not.\n"
     "Example: sudo qduino restore"}};

}  // namespace
}  // namespace qduino::apps
