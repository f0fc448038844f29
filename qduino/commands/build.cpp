// qduino build: the programs of a sketch, in the cache or where they are wanted.
#include <cstdio>
#include <filesystem>
#include <system_error>

#include "qduino/built_sketch.h"
#include "qduino/command.h"
#include "terminal/human.h"
#include "terminal/message.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

class Build final : public Command {
    void declare(CLI::App& app) override {
        sketch_.declare(app);
        add_option(app, "--only", only_, "One board: sim or linux", "BOARD")
            ->check(CLI::IsMember({"sim", "linux"}));
        add_option(app, "-o,--output", output_, "Copy the programs into this folder", "DIR");
        app.add_flag("--compile-commands", compile_commands_, "Write compile_commands.json, for clangd");
    }

    Result<int> run() override {
        std::vector<BoardKind> boards{BoardKind::sim, BoardKind::linux};
        if (!only_.empty()) boards = {only_ == "sim" ? BoardKind::sim : BoardKind::linux};
        const Result<BuiltSketch> built = build_sketch(sketch_, boards);
        if (!built) {
            const int status = say_failed(built.error());
            say(verdict("nothing was built."));
            return status;
        }
        for (const fs::path& program : built->programs) {
            QDUINO_TRY_ASSIGN(const fs::path made, deliver(program));
            std::printf("%s\n", made.c_str());
        }
        std::fflush(stdout);
        if (compile_commands_) {
            QDUINO_TRY_ASSIGN(const SketchBuild made,
                              SketchBuild::open(built->sdk, built->sketch, environment_of_this_process()));
            QDUINO_TRY(made.write_compile_commands());
        }
        say(verdict(built->sketch.name + (built->steps == 0
                                              ? " is up to date."
                                              : " is built: " + counted(built->steps, "step") + ".")));
        return 0;
    }

    /// Where the program is, copied if somebody wants it elsewhere.
    [[nodiscard]] Result<fs::path> deliver(const fs::path& program) const {
        if (output_.empty()) return program;
        const fs::path copy = fs::path(output_) / program.filename();
        std::error_code failed;
        fs::create_directories(output_, failed);
        fs::copy_file(program, copy, fs::copy_options::overwrite_existing, failed);
        if (failed)
            return make_error(ErrorCode::unavailable, "cannot write ", copy.native(), ": ", failed.message());
        return copy;
    }

    SketchOptions sketch_;
    std::string only_;    // "sim", "linux" or empty
    std::string output_;  // a folder
    bool compile_commands_ = false;
};

const Listed<Build> build_listed{
    {Place::build, "build", "Compile a sketch",
     "Makes two programs, for the simulator and for Linux, in the cache\n"
     "($XDG_CACHE_HOME/qduino), and prints their paths. Only what has changed is\n"
     "made again. Errors point into the .ino. .cpp and .c files beside it, and in\n"
     "src/, are compiled too. Honours CXX, CC, CXXFLAGS, CFLAGS, LDFLAGS.\n"
     "Example: qduino build blinker --only linux --output /tmp"}};

}  // namespace
}  // namespace qduino::apps
