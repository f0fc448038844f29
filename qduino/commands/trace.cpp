// qduino trace: who ran when, in the simulator or on Linux.
#include <unistd.h>

#include <cstdio>
#include <optional>
#include <string>

#include "base/text.h"
#include "board/linux/kernel/memory_folder.h"
#include "board/linux/loop/budget_keeper.h"
#include "posix/small_file.h"
#include "qduino/built_sketch.h"
#include "qduino/command.h"
#include "qduino/linux_run.h"
#include "qduino/trace/kernel_trace.h"
#include "qduino/trace/traced_picture.h"
#include "terminal/message.h"

namespace qduino::apps {
namespace {

constexpr double kTraceSeconds = 10;

Result<void> write_trace(KernelTraceReader& reader, const std::string& path) {
    if (!posix::write_file(path, reader.chrome_json()))
        return make_error(ErrorCode::unavailable, "the trace cannot be written: ", path);
    std::fputs(
        text<std::string>(
            "trace: ", path, "\n  (open it in ui.perfetto.dev or chrome://tracing): ", reader.stretches(),
            " stretches of loops, wakes,\n"
            "preemption, throttling and interrupts, as the kernel saw them. Not in it: where a\n"
            "release begins in a loop that spins on its own core, and overruns (counted above).\n")
            .c_str(),
        stderr);
    if (reader.lost() > 0) {
        std::fprintf(stderr, "The oldest %lld events did not fit the kernel's buffer: trace for less time.\n",
                     static_cast<long long>(reader.lost()));
    }
    return {};
}

class Trace final : public Command {
    void declare(CLI::App& app) override {
        sketch_.declare(app);
        add_option(app, "-o,--output", output_, "File to write (default: NAME-trace.json)", "FILE");
        length_.declare(app, "Seconds (default 10)");
        picture_.declare(app, "Draw loops and pins as well, as .svg");
        shown_.declare(app);
        CLI::Option* on_linux = app.add_flag("--linux", on_linux_, "Trace a run on Linux (root)");
        simulated_.declare(app);
        for (const char* option : {"--cores", "--seed"}) app.get_option(option)->excludes(on_linux);
    }

    Result<int> run() override {
        if (output_.empty()) {
            QDUINO_TRY_ASSIGN(const Sketch sketch, find_sketch(sketch_.sketch));
            output_ = sketch.name + "-trace.json";
        }
        if (on_linux_) return run_on_this_computer();
        return become_simulation(sketch_, simulated_.board, picture_, [this](const Sketch&) {
            Words words{"--trace", output_};
            length_.add_to(words);
            simulated_.add_to(words);
            picture_.add_to(words);
            shown_.add_to(words);
            return words;
        });
    }

    Result<int> run_on_this_computer() {
        const ReadBoardFile read = simulated_.board.read();
        if (!read.ok()) return say_failed(read.error);
        const PinsAsked asked{picture_, shown_};
        board::linux::MemoryFolder folder;
        std::string admission;
        if (!picture_.file.empty()) {
            QDUINO_TRY(picture_.check());
            QDUINO_TRY_ASSIGN(folder, board::linux::MemoryFolder::make(board::linux::MemoryFolder::kParent));
            admission = folder.file("admission.json");
        }
        QDUINO_TRY_ASSIGN(const BuiltSketch built, build_sketch(sketch_, {BoardKind::linux}));
        QDUINO_TRY_ASSIGN(KernelTracer tracer, KernelTracer::start());
        QDUINO_TRY_ASSIGN(const LinuxRun ended, run_on_linux(program_of(built, read, admission), &asked));
        if (ended.status == 2) return 2;  // refused: there was nothing to record
        KernelTraceReader reader(board::linux::BudgetKeeper::signal_number(), ::getpid());
        std::optional<TracedPicture> drawing;
        if (!admission.empty()) {
            drawing.emplace(built.sketch.name, admitted_loops(admission),
                            TracedWindow{picture_.from_s.value_or(0), picture_.length_s});
            reader.draw_into(*drawing);
        }
        QDUINO_TRY(tracer.stop(reader));
        QDUINO_TRY(write_trace(reader, output_));
        PinWitness* const pins = ended.pins ? &ended.pins->witness() : nullptr;
        if (pins) QDUINO_TRY(show_pins(*ended.pins, asked, pins_of(*pins, built.sketch.name, asked)));
        if (drawing) QDUINO_TRY(drawing->write(picture_.file, pins));
        return ended.status;
    }

    /// `admission`: where the run writes it; empty: nowhere.
    [[nodiscard]] LinuxProgram program_of(const BuiltSketch& built, const ReadBoardFile& read,
                                          const std::string& admission) const {
        LinuxProgram program{
            .program = built.programs[0],
            .supervisor = built.sdk.supervisor,
            .board = read.board.linux,
            .pins = {},
            .words = {"--for", text<std::string>(Shortest{length_.seconds.value_or(kTraceSeconds)})}};
        simulated_.board.add_to(program.words);
        if (!admission.empty()) add_words(program.words, "--admission", admission);
        return program;
    }

    SketchOptions sketch_;
    std::string output_;
    LengthOption length_;
    PictureOptions picture_;
    ShownOptions shown_;
    bool on_linux_ = false;
    SimulatedOptions simulated_;
};

const Listed<Trace> trace_listed{
    {Place::trace, "trace", "Record who ran when",
     "Runs the sketch in the simulator and writes a file for ui.perfetto.dev or\n"
     "chrome://tracing: releases, preemption, throttling, replenishment, overruns,\n"
     "interrupts, per core. With --linux it runs in real time, and the kernel's\n"
     "tracer records what the kernel knows: who ran when, wakes, preemption,\n"
     "throttling, interrupts, but no overruns; root only.\n"
     "Example: qduino trace blinker --for 2 -o blinker.json"}};

}  // namespace
}  // namespace qduino::apps
