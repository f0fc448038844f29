// qduino profile: what loops and handlers take, and budgets that suit them.
#include <string>
#include <vector>

#include "base/text.h"
#include "board/linux/kernel/memory_folder.h"
#include "posix/small_file.h"
#include "qduino/built_sketch.h"
#include "qduino/command.h"
#include "qduino/common/child_process.h"
#include "qduino/linux_run.h"
#include "qduino/trace/profile_result.h"
#include "terminal/message.h"

namespace qduino::apps {
namespace {

constexpr double kProfileSeconds = 10;

class Profile final : public Command {
    void declare(CLI::App& app) override {
        sketch_.declare(app);
        length_.declare(app, "Seconds (default 10)");
        add_option(app, "--margin", margin_percent_, "Above the worst, in % (default 20)", "P")
            ->check(number_within(0.0, 1000.0));
        CLI::Option* write = app.add_flag("--write", write_, "Put the suggestions into the sketch");
        add_option(app, "-o,--output", output_, "Keep the profile here, as JSON", "FILE");
        CLI::Option* real_time =
            app.add_flag("--real-time", real_time_, "Real-time scheduling, budgets enforced");
        app.add_flag("--sim", in_simulator_, "In the simulator: modelled times alone")
            ->excludes(write)
            ->excludes(real_time);
        board_.declare(app);
        pins_.declare(app);
    }

    Result<int> run() override {
        const ReadBoardFile read = board_.read();
        if (!read.ok()) return say_failed(read.error);
        QDUINO_TRY_ASSIGN(const Sketch sketch, find_sketch(sketch_.sketch));
        QDUINO_TRY_ASSIGN(const std::vector<TabText> tabs, read_tabs(sketch.tabs));
        const BoardKind board = in_simulator_ ? BoardKind::sim : BoardKind::linux;
        QDUINO_TRY_ASSIGN(const BuiltSketch built, build_sketch(sketch_, {board}));
        QDUINO_TRY_ASSIGN(const auto folder,
                          board::linux::MemoryFolder::make(board::linux::MemoryFolder::kParent));
        const std::string file = output_.empty() ? folder.file("profile").string() : output_;
        QDUINO_TRY_ASSIGN(const int status, measure(built, read.board.linux, file));
        if (status != 0) {
            say(verdict(end_of(built.sketch.name, status)));
            return status;
        }
        QDUINO_TRY_ASSIGN(const std::string profile, posix::read_small_file(file));
        if (in_simulator_) return 0;
        return apply_profile(profile, tabs, write_);
    }

    /// Runs the program that measures, which writes `file`, and returns its status.
    [[nodiscard]] Result<int> measure(const BuiltSketch& built, const board::linux::LinuxConfig& board,
                                      const std::string& file) const {
        Words words{"--for", text<std::string>(Shortest{length_.seconds.value_or(kProfileSeconds)})};
        board_.add_to(words);
        append(words, {"--profile", file, "--margin", text<std::string>(Shortest{margin_percent_})});
        if (in_simulator_) {
            Words command{built.programs[0].string(), "--no-admission"};
            append(command, words);
            return run_in_front(command);
        }
        if (!real_time_) words.emplace_back("--best-effort");
        QDUINO_TRY_ASSIGN(const LinuxRun ended, run_on_linux({.program = built.programs[0],
                                                              .supervisor = built.sdk.supervisor,
                                                              .board = board,
                                                              .pins = pins_.file,
                                                              .best_effort = !real_time_,
                                                              .words = words},
                                                             nullptr));
        return ended.status;
    }

    SketchOptions sketch_;
    LengthOption length_;
    double margin_percent_ = 20;
    bool write_ = false, real_time_ = false, in_simulator_ = false;
    std::string output_;
    BoardOption board_;
    PinsOption pins_;
};

const Listed<Profile> profile_listed{
    {Place::profile, "profile", "Measure loops, and suggest budgets",
     "Runs the sketch and measures the CPU time of each release of a loop and each\n"
     "run of a handler. Suggests C = the worst observed and a margin, and T, shows\n"
     "the change of the sketch, and writes it with --write. Nothing is enforced\n"
     "meanwhile; with --real-time all is as in `qduino run`.\n"
     "Example: qduino profile blinker --for 60 --margin 50 --write"}};

}  // namespace
}  // namespace qduino::apps
