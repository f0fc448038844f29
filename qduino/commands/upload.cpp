// qduino upload: a sketch that runs on when its maker has gone, here or on another computer.
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "board/linux/kernel/memory_folder.h"
#include "qduino/built_sketch.h"
#include "qduino/command.h"
#include "qduino/common/child_process.h"
#include "qduino/ide/ide_recipe.h"
#include "qduino/linux_run.h"
#include "qduino/upload/board_folder.h"
#include "qduino/upload/remote.h"
#include "qduino/upload/sketch_keeper.h"
#include "qduino/upload/sketch_parcel.h"
#include "terminal/message.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

/// What is to be started, and its twin in the simulator, which is asked before.
struct Uploaded {
    std::string name;
    fs::path program, simulated;
};

int refuse(const Uploaded& made, const BoardFolder& board) {
    const auto old = board.running();
    say(verdict(made.name + " is REFUSED, and was not started." +
                (old ? " " + old->sketch + " runs on." : "")));
    return 2;
}

class Upload final : public Command {
    void declare(CLI::App& app) override {
        sketch_.declare(app);
        to_.declare(app);
        app.add_flag("--stop", stop_, "End the sketch that was uploaded");
        // It may be a file of the other computer.
        add_option(app, "--board", board_.file, "Board file of the computer that runs it", "FILE");
        real_time_.declare(app);
        add_option(app, "--built", built_, "What the Arduino IDE has built", "BUILD/NAME");
        app.add_flag("--from-stdin", from_stdin_, "The sketch comes as a tar: --to does this");
    }

    Result<int> run() override {
        if (stop_) return end_sketch();
        return to_.host.empty() ? start_here() : send_there();
    }

    [[nodiscard]] Result<int> end_sketch() const {
        if (!to_.host.empty()) return run_remote(to_.host, {"upload", "--stop"});
        QDUINO_TRY_ASSIGN(const BoardFolder board, BoardFolder::open());
        QDUINO_TRY_ASSIGN(const std::string ended, board.stop());
        say(verdict(ended.empty() ? "no uploaded sketch was running." : ended + " is stopped."));
        return 0;
    }

    /// Sends it to another computer, which builds, judges and starts it.
    [[nodiscard]] Result<int> send_there() const {
        QDUINO_TRY_ASSIGN(Sdk sdk, sdk_of_this_program());
        BuildEnvironment environment = environment_of_this_process();
        fs::path place = sketch_.sketch;
        if (!built_.empty()) {
            QDUINO_TRY_ASSIGN(const IdeProject project, read_ide_project(built_));
            place = project.sketch;
            environment.qduino_libraries = project.libraries;
        }
        QDUINO_TRY_ASSIGN(const Sketch sketch, find_sketch(place));
        QDUINO_TRY_ASSIGN(const SketchBuild build, SketchBuild::open(std::move(sdk), sketch, environment));
        QDUINO_TRY_ASSIGN(const std::vector<Library> libraries, build.find_libraries());
        QDUINO_TRY_ASSIGN(const auto folder,
                          board::linux::MemoryFolder::make(board::linux::MemoryFolder::kParent));
        const fs::path parcel = folder.file("parcel");
        QDUINO_TRY(pack_sketch(sketch, libraries, parcel));
        Words words{"upload", "--from-stdin"};
        real_time_.add_to(words);
        board_.add_to(words);
        return send_folder(to_.host, parcel, words);
    }

    [[nodiscard]] Result<Uploaded> make() const {
        if (!built_.empty()) {
            return Uploaded{fs::path(built_).stem().string(), built_by_ide(built_, BoardKind::linux),
                            built_by_ide(built_, BoardKind::sim)};
        }
        QDUINO_TRY_ASSIGN(const BuiltSketch built, build_sketch(sketch_, {BoardKind::sim, BoardKind::linux}));
        return Uploaded{built.sketch.name, built.programs[1], built.programs[0]};
    }

    /// Starts it in the place of the one that runs.
    Result<int> start_here() {
        QDUINO_TRY_ASSIGN(const BoardFolder board, BoardFolder::open());
        if (from_stdin_) {
            QDUINO_TRY_ASSIGN(sketch_.sketch, unpack_sketch(board.incoming()));
        }
        const ReadBoardFile read = board_.read();
        if (!read.ok()) return say_failed(read.error);
        QDUINO_TRY_ASSIGN(const Sdk sdk, sdk_of_this_program());
        QDUINO_TRY_ASSIGN(const Uploaded made, make());
        Words judge{made.simulated.string(), "--check"};
        board_.add_to(judge);
        QDUINO_TRY_ASSIGN(const int judged, run_in_front(judge));
        if (judged == 2) return refuse(made, board);
        if (judged != 0) return judged;
        QDUINO_TRY_ASSIGN(const std::string replaced, board.stop());
        LinuxProgram program{.program = made.program,
                             .supervisor = sdk.supervisor,
                             .board = read.board.linux,
                             .pins = {},
                             .best_effort = real_time_.best_effort,
                             .words = {"--report", board.report()}};
        board_.add_to(program.words);
        real_time_.add_to(program.words);
        const CommandMaker command = [&](board::linux::MemoryFolder& folder) {
            return linux_command(program, folder, Behind::nobody);
        };
        QDUINO_TRY_ASSIGN(const std::optional<int> ended, start_kept(board, made.name, command));
        if (ended) {
            say(verdict(end_of(made.name, *ended) +
                        (replaced.empty() ? "" : " " + replaced + " was stopped before.")));
            return *ended;
        }
        say(verdict(made.name + " runs" + (replaced.empty() ? "" : ", in the place of " + replaced) +
                    ": 'qduino monitor' shows its Serial."));
        return 0;
    }

    SketchOptions sketch_;
    ToOption to_;
    bool stop_ = false;
    BoardOption board_;
    RealTimeOptions real_time_;
    std::string built_;        // what the IDE has built, BUILD/NAME
    bool from_stdin_ = false;  // the sketch comes as a tar
};

const Listed<Upload> upload_listed{
    {Place::upload, "upload", "Start a sketch, and leave it running",
     "Builds the sketch, checks it, ends the one that was uploaded before, and starts\n"
     "this one under qduino-supervisor, as 'qduino run' does. It runs on when you log\n"
     "out; 'qduino monitor' is its Serial. With --to the sketch and its libraries are\n"
     "sent to another computer as sources, and built and judged there.\n"
     "Ends with 2 when admission refuses it: the old one then runs on.\n"
     "Example: qduino upload blinker --to pi@printer.local"}};

}  // namespace
}  // namespace qduino::apps
