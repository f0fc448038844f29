// main() of a sketch on the Linux board: linked with a sketch, it runs it in real time until Ctrl-C and says what is guaranteed.
#include <chrono>
#include <cstdio>

#include <CLI/CLI.hpp>

#include "apps/guarantee/guarantee_report.h"
#include "apps/host/bind_linux.h"
#include "apps/host/sketch_report.h"

namespace {

using namespace qduino;

int fail(std::string_view message) {
    return std::fprintf(stderr, "%.*s\n", static_cast<int>(message.size()), message.data()), 1;
}

int run(board::linux::LinuxConfig config, double length_s) {
    auto opened = board::linux::LinuxBoard::open(std::move(config));
    if (!opened) return fail(opened.error().message);
    board::linux::LinuxBoard& board = *opened.value();
    runtime::Runtime<board::linux::LinuxBoard> runtime(board);
    port::bind(&runtime);
    if (Result<void> begun = runtime.begin(runtime::sketch_table()); !begun) {
        fail(begun.error().message);
        fail(runtime.explanation());
        return 2;
    }
    std::fputs(std::string(runtime.plan().admission_table().view()).c_str(), stderr);
    std::fputs(apps::guarantee_text(board.guarantee()).c_str(), stderr);
    runtime.run(length_s > 0 ? board.now() + from_seconds(length_s) : kForever);
    board.request_stop();
    runtime.run(board.now() + 2s);
    std::fputs(apps::loop_table(apps::loops_of(runtime)).c_str(), stderr);
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    board::linux::LinuxConfig config;
    double length_s = 0;
    bool best_effort = false;
    CLI::App app("This sketch on this machine, in real time, until Ctrl-C.");
    app.footer(
        "Example: blink-linux --pins /dev/shm/qduino/pins     (pins of a virtual machine)\n"
        "Ends with 2 when admission refuses the sketch.");
    app.add_option("--for", length_s, "Seconds to run; 0: until Ctrl-C")->check(CLI::NonNegativeNumber);
    app.add_option("--pins", config.pins_path, "File of the virtual pins, made by virtual-machine");
    app.add_flag("--isolate", config.isolate,
                 "Move everything else off the cores that loops own; undone at the end (root)");
    app.add_flag("--best-effort", best_effort, "Do not ask for real-time scheduling");
    CLI11_PARSE(app, argc, argv);
    config.real_time = !best_effort;
    return run(std::move(config), length_s);
}
