// qduino ide: makes this board one of the Arduino IDE's, and carries out its recipes.
#include <cstdio>
#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

#include "qduino/build/tool_commands.h"
#include "qduino/built_sketch.h"
#include "qduino/command.h"
#include "qduino/common/host_name.h"
#include "qduino/ide/ide_discovery.h"
#include "qduino/ide/ide_monitor.h"
#include "qduino/ide/ide_platform.h"
#include "qduino/ide/ide_recipe.h"
#include "qduino/ide/ide_serial.h"
#include "terminal/parser.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

constexpr const char* kAfterInstall =
    "In the IDE (1.8), after it was started anew: Tools, Board, QduinoMC. Its sketchbook (File,\n"
    "Preferences) is to be the folder above. Without a window:\n"
    "  arduino-builder -compile -fqbn qduino:linux:here \\\n"
    "    -hardware /usr/share/arduino-builder -hardware %s \\\n"
    "    -tools /usr/share/arduino-builder SKETCH.ino\n";

class Ide final : public Command {
    void declare(CLI::App& app) override {
        add_option(app, "action", action_, "install or remove", "ACTION")
            ->required()
            ->check(CLI::IsMember({"install", "remove", "preprocess", "compile", "link", "check", "size",
                                   "discovery", "serial", "monitor"}));
        add_option(app, "folder", folder_, "The IDE's sketchbook", "[FOLDER]");
        add_option(app, "--to", hosts_, "A board more: this computer, by ssh", "USER@HOST")
            ->check(CLI::Validator(host_error, "USER@HOST"));
    }

    /// A recipe's words are a compiler's.
    std::size_t take_words(const CLI::App&, const std::vector<std::string>& words) override {
        if (words.empty() || words[0].starts_with('-') || words[0] == "install" || words[0] == "remove")
            return words.size();
        recipe_.assign(words.begin() + 1, words.end());
        return 1;
    }

    Result<int> run() override {
        if (action_ == "discovery") {
            IdeDiscovery discovery(ports_of(recipe_));
            return run_ide_tool(discovery);
        }
        if (action_ == "serial") return ide_serial(recipe_);
        if (action_ == "monitor") {
            IdeMonitor monitor;
            return run_ide_tool(monitor);
        }
        QDUINO_TRY_ASSIGN(const Sdk sdk, sdk_of_this_program());
        if (is_recipe(action_)) return run_recipe(sdk, action_, recipe_);
        QDUINO_TRY_ASSIGN(const fs::path book, sketchbook(folder_, environment_of_this_process().home));
        if (action_ == "remove") {
            std::printf(remove_platform(book) ? "The board is gone from %s\n" : "There was no board in %s\n",
                        book.c_str());
            return 0;
        }
        std::error_code failed;
        const fs::path program = fs::read_symlink("/proc/self/exe", failed);
        QDUINO_TRY_ASSIGN(const fs::path folder, install_platform(book, program, hosts_));
        std::printf("%s\n", folder.c_str());
        std::fprintf(stderr, kAfterInstall, (book / "hardware").c_str());
        return 0;
    }

    std::string action_;
    std::string folder_;               // the sketchbook
    std::vector<std::string> hosts_;   // "user@host", as ssh takes it
    std::vector<std::string> recipe_;  // its words
};

const Listed<Ide> ide_listed{{Place::ide, "ide", "Build with the Arduino IDE",
                              "'install' makes this board one of the IDE's (and of arduino-builder's):\n"
                              "FOLDER is its sketchbook, ~/Arduino by default. The IDE then builds with the\n"
                              "options of 'qduino build', shows the verdict of admission, and uploads with\n"
                              "'qduino upload'. 'remove' takes the board away. The other actions are what\n"
                              "the board's platform.txt calls.\n"
                              "Example: qduino ide install --to pi@printer.local"}};

}  // namespace
}  // namespace qduino::apps
