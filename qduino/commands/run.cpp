// qduino run: a sketch in real time on this computer.
#include <string>

#include "qduino/built_sketch.h"
#include "qduino/command.h"
#include "qduino/linux_run.h"
#include "report/picture/page.h"
#include "report/picture/picture_file.h"
#include "terminal/message.h"

namespace qduino::apps {
namespace {

class Run final : public Command {
    void declare(CLI::App& app) override {
        sketch_.declare(app);
        length_.declare(app, "Seconds (default: until Ctrl-C)");
        board_.declare(app);
        pins_.declare(app);
        real_time_.declare(app);
        picture_.declare(app, "Draw the pins, where they are connected to nothing: .svg");
        shown_.declare(app);
        report_.declare(app);
    }

    Result<int> run() override {
        const ReadBoardFile read = board_.read();
        if (!read.ok()) return say_failed(read.error);
        QDUINO_TRY(picture_.check());
        QDUINO_TRY_ASSIGN(const BuiltSketch built, build_sketch(sketch_, {BoardKind::linux}));
        const PinsAsked asked{picture_, shown_};
        QDUINO_TRY_ASSIGN(const LinuxRun ended, run_on_linux(program_of(built, read), &asked));
        if (ended.pins && ended.status != 2) QDUINO_TRY(show(*ended.pins, built.sketch.name, asked));
        say(verdict(end_of(built.sketch.name, ended.status)));
        return ended.status;
    }

    [[nodiscard]] LinuxProgram program_of(const BuiltSketch& built, const ReadBoardFile& read) const {
        LinuxProgram program{.program = built.programs[0],
                             .supervisor = built.sdk.supervisor,
                             .board = read.board.linux,
                             .pins = pins_.file,
                             .best_effort = real_time_.best_effort,
                             .words = {}};
        length_.add_to(program.words);
        board_.add_to(program.words);
        report_.add_to(program.words);
        real_time_.add_to(program.words);
        return program;
    }

    [[nodiscard]] Result<void> show(LoosePins& pins, const std::string& name, const PinsAsked& asked) const {
        const picture::Schedule schedule = pins_of(pins.witness(), name, asked);
        QDUINO_TRY(show_pins(pins, asked, schedule));
        if (picture_.file.empty() || schedule.pins.empty()) return {};
        QDUINO_TRY(picture::write_picture(picture_.file, picture::svg_page(schedule)));
        say("picture: " + picture_.file);
        return {};
    }

    SketchOptions sketch_;
    LengthOption length_;
    BoardOption board_;
    PinsOption pins_;
    RealTimeOptions real_time_;
    PictureOptions picture_;
    ShownOptions shown_;
    ReportOption report_;
};

const Listed<Run> run_listed{{Place::run, "run", "Run a sketch here, in real time",
                              "Under qduino-supervisor: when the sketch dies or hangs, pins with a safe\n"
                              "state are forced to it. Says which guarantees hold. Ends with 2 when\n"
                              "admission refuses the sketch.\n"
                              "Example: qduino run blinker --for 10 --report guarantees.json"}};

}  // namespace
}  // namespace qduino::apps
