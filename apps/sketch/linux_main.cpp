// main() of a sketch on the Linux board: runs the sketch in real time until Ctrl-C, and reports
// what is guaranteed.
#include <unistd.h>

#include <filesystem>

#include "apps/sketch/sketch_main.h"
#include "board/linux/linux_board.h"
#include "config/board_file.h"
#include "posix/small_file.h"
#include "report/admission_report.h"
#include "report/crash_report.h"
#include "report/guarantee_report.h"
#include "report/sketch_report.h"
#include "terminal/command_line.h"
#include "terminal/program.h"

namespace {

using namespace qduino;
using runtime::Runtime;

constexpr apps::Fail fail{""};

struct Options : apps::SketchOptions {  // length_s 0: until Ctrl-C
    std::string pins_path;
    std::string admission_path;
    bool isolate = false;
    bool best_effort = false;
};

/// For `qduino trace --picture`, which knows nothing else of the loops.
void write_admission(const Options& options, Runtime& runtime) {
    if (options.admission_path.empty()) return;
    const apps::CheckedBoard checked{.sketch = {},
                                     .board_file = options.board_path,
                                     .cores = runtime.board().core_count(),
                                     .setup_ran = true};
    const std::string json = apps::admission_json(runtime.plan(), runtime::sketch_table(), checked);
    if (const auto written = posix::write_file(options.admission_path, json); !written) fail(written.error());
}

/// A profile without real-time scheduling cuts nobody: the budgets are what it is to find.
bool is_measured_freely(const Options& options) { return options.profiles() && options.best_effort; }

/// A loop whose core is taken, or that does not listen, has not returned from its body.
void leave_if_loops_go_on(board::linux::LinuxBoard& board, const Runtime& runtime) {
    if (board.loops_ended()) return;
    apps::settle_sketch_output();
    fail(apps::loops_left(apps::loops_of(runtime)) + "; the sketch is ended as it is, with its safe states");
    board.abandon();
    ::_exit(1);
}

int run(const Options& options, board::linux::LinuxConfig config) {
    auto opened = board::linux::LinuxBoard::open(std::move(config));
    if (!opened) return fail(opened.error());
    board::linux::LinuxBoard& board = **opened;
    apps::SketchCourse course;
    // A budget that is to be found must not refuse the sketch.
    course.runtime.enforce_admission = !is_measured_freely(options);
    course.opening = [&] { return apps::guarantee_text(board.guarantee()); };
    course.play = [&](Runtime& runtime) {
        write_admission(options, runtime);
        runtime.run(options.length_s > 0 ? board.now() + from_seconds(options.length_s) : kForever);
    };
    course.stop = [&](Runtime& runtime) {
        board.request_stop();
        runtime.run(board.now() + 2s);
    };
    course.report = [&](const auto&) {
        const board::GuaranteeReport end = apps::guarantee_of(*Runtime::current());
        apps::report_beside_sketch(text<std::string>(apps::run_report(*Runtime::current(), board.now()),
                                                     apps::delays_explained(end), apps::budgets_kept(end),
                                                     '\n'));
        return 0;
    };
    course.leave = [&](int) { leave_if_loops_go_on(board, *Runtime::current()); };
    return apps::run_sketch(board, options, course);
}

/// The configuration of the board file, or the default, with the changes of the command line.
std::string read_config(const Options& options, board::linux::LinuxConfig& config) {
    if (!options.board_path.empty()) {
        apps::ReadBoardFile read = apps::read_board_file(options.board_path);
        if (!read.ok()) return read.error;
        config = std::move(read.board.linux);
    }
    if (!options.pins_path.empty()) config.pins_path = options.pins_path;
    if (options.isolate) config.isolate = true;
    if (options.best_effort) config.real_time = false;
    if (is_measured_freely(options)) config.enforce_budgets = false;
    return {};
}

}  // namespace

int main(int argc, char** argv) {
    apps::keep_standard_descriptors();
    Options options;
    apps::CommandLine line{
        "This sketch on this computer, in real time, until Ctrl-C.",
        "Example: blink-linux --pins /dev/shm/qduino/pins     (pins of a virtual machine)\n"
        "Ends with 2 when admission refuses the sketch."};
    apps::add_sketch_options(line, options, "Seconds to run; 0: until Ctrl-C",
                             "Board file: [linux], [[gpio]] and so on")
        .not_negative();
    line.option("--pins", options.pins_path, "File of virtual pins, of virtual-machine").called("FILE");
    line.option("--admission", options.admission_path, "Write admission's answer here, as JSON")
        .called("FILE");
    line.flag("--isolate", options.isolate, "Empty the cores that loops own; undone at the end");
    line.flag("--best-effort", options.best_effort, "Do not ask for real-time scheduling");
    if (const auto status = line.parse(argc, argv)) return *status;
    options.name = std::filesystem::path(argv[0]).filename().string();
    if (options.name.ends_with("-linux")) options.name.resize(options.name.size() - 6);
    board::linux::LinuxConfig config;
    if (const std::string wrong = read_config(options, config); !wrong.empty()) return fail(wrong);
    apps::prepare_crash_words();
    config.last_words = [](int signal, const siginfo_t* info, const void* machine_context) {
        apps::say_crash(apps::name_of_vcpu(board::current().current_vcpu()), signal, info, machine_context);
    };
    return run(options, std::move(config));
}
