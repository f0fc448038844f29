// qduino new: a sketch to begin with.
#include <cstdio>
#include <filesystem>

#include "qduino/command.h"
#include "qduino/common/child_process.h"
#include "qduino/common/sketch_folder.h"
#include "terminal/message.h"
#include "terminal/parser.h"

namespace qduino::apps {
namespace {

class MakeNew final : public Command {
    void declare(CLI::App& app) override {
        add_option(app, "name", name_, "Name, or path, of the new folder", "NAME")->required();
    }

    Result<int> run() override {
        QDUINO_TRY_ASSIGN(const std::filesystem::path made, make_sketch(name_));
        std::printf("%s\n", made.c_str());
        // The path alone is for programs.
        say("Next: " + shell_words({"cd", made.parent_path().native()}) + " && qduino check");
        return 0;
    }

    std::string name_;
};

const Listed<MakeNew> make_new_listed{{Place::make_new, "new", "Make a sketch to begin with",
                                       "Makes the folder NAME with NAME.ino: two loops, ready to run.\n"
                                       "Overwrites nothing.\n"
                                       "Example: qduino new blinker && cd blinker && qduino sim"}};

}  // namespace
}  // namespace qduino::apps
