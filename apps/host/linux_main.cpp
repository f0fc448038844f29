// main() of a sketch on the Linux board: runs the sketch in real time until Ctrl-C, and reports
// what is guaranteed.
#include <chrono>
#include <cstdio>
#include <string>

#include <CLI/CLI.hpp>

#include "apps/board_file/board_file.h"
#include "apps/command_line/command_line.h"
#include "apps/guarantee/guarantee_report.h"
#include "apps/host/sketch_output.h"
#include "apps/host/sketch_report.h"
#include "apps/host/write_report.h"
#include "apps/terminal/program.h"
#include "board/linux/linux_board.h"
#include "runtime/runtime.h"

namespace {

using namespace qduino;

constexpr apps::Fail fail{""};

struct Options {
    double length_s = 0;  // 0: until Ctrl-C
    std::string board_path;
    std::string pins_path;
    std::string report_path;
    bool isolate = false;
    bool best_effort = false;
};

/// Writes the report: at the start, and again at the end, when residual interrupts have been
/// counted.
bool report_to(const std::string& path, board::linux::LinuxBoard& board) {
    if (path.empty()) return true;
    const Result<void> written = apps::write_guarantee(board.guarantee(), path);
    if (!written) fail(written.error().message);
    return written.ok();
}

/// The sketch, with its loops' output held back behind setup()'s: the guarantees are reported
/// before their first words.
runtime::SketchTable quiet_sketch() {
    static void (*const setup)() = runtime::sketch_table().setup;
    runtime::SketchTable table = runtime::sketch_table();
    table.setup = [] {
        if (setup) setup();
        apps::settle_sketch_output();
        apps::hold_sketch_output(true);
    };
    return table;
}

int run(const Options& options, board::linux::LinuxConfig config) {
    auto opened = board::linux::LinuxBoard::open(std::move(config));
    if (!opened) return fail(opened.error().message);
    board::linux::LinuxBoard& board = *opened.value();
    runtime::Runtime runtime(board);
    if (Result<void> begun = runtime.begin(quiet_sketch()); !begun) {
        fail(begun.error().message);
        // Admission agreed, so the board refused.
        if (runtime.plan().admitted() && runtime.plan().refused_ios().empty()) return 1;
        fail(runtime.explanation());
        return 2;
    }
    apps::report_beside_sketch(std::string(runtime.plan().admission_table().view()) +
                               apps::guarantee_text(board.guarantee()) + "\n");
    apps::hold_sketch_output(false);
    bool reported = report_to(options.report_path, board);
    runtime.run(options.length_s > 0 ? board.now() + from_seconds(options.length_s) : kForever);
    reported = report_to(options.report_path, board) && reported;
    board.request_stop();
    runtime.run(board.now() + 2s);
    const auto loops = apps::loops_of(runtime);
    apps::settle_sketch_output();
    apps::report_beside_sketch(apps::loop_table(loops) + "Periods: " + apps::periods_kept(loops) + ".\n\n");
    return reported ? 0 : 1;
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
    return {};
}

}  // namespace

int main(int argc, char** argv) {
    Options options;
    CLI::App app("This sketch on this machine, in real time, until Ctrl-C.");
    app.footer(
        "Example: blink-linux --pins /dev/shm/qduino/pins     (pins of a virtual machine)\n"
        "Ends with 2 when admission refuses the sketch.");
    app.add_option("--for", options.length_s, "Seconds to run; 0: until Ctrl-C")
        ->check(CLI::NonNegativeNumber)
        ->option_text("S");
    app.add_option("--board", options.board_path, "Board file: [linux], [[gpio]] and so on")
        ->option_text("FILE");
    app.add_option("--pins", options.pins_path, "File of virtual pins, of virtual-machine")
        ->option_text("FILE");
    app.add_flag("--isolate", options.isolate, "Empty the cores that loops own; undone at the end");
    app.add_option("--report", options.report_path, "Write the guarantee report here, as JSON")
        ->option_text("FILE");
    app.add_flag("--best-effort", options.best_effort, "Do not ask for real-time scheduling");
    if (const auto status = apps::parse_command_line(app, argc, argv)) return *status;
    board::linux::LinuxConfig config;
    if (const std::string wrong = read_config(options, config); !wrong.empty()) return fail(wrong);
    return run(options, std::move(config));
}
