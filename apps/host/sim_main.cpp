// main() of a sketch in the simulator: linked with a sketch, it runs it in virtual time and says how its loops kept theirs.
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <thread>

#include <CLI/CLI.hpp>

#include "apps/guarantee/guarantee_report.h"
#include "apps/host/bind_sim.h"
#include "apps/host/chrome_trace.h"
#include "apps/host/sketch_report.h"

namespace {

using namespace qduino;

struct Options {
    double length_s = 10;
    double speed = 0;  // virtual seconds per second; 0: as fast as it goes
    std::string trace_path;
    bool enforce_admission = true;
    board::sim::SimConfig machine;
};

std::atomic<bool> interrupted{false};

int refuse(const runtime::Runtime<board::sim::SimBoard>& runtime, const Error& error) {
    const auto explanation = runtime.explanation().view();
    const std::string_view text = explanation.empty() ? error.message.view() : explanation;
    std::fprintf(stderr, "%.*s\n%.*s\n", static_cast<int>(error.message.size()), error.message.view().data(),
                 static_cast<int>(text.size()), text.data());
    return 2;
}

/// In slices of 10 ms, so that Ctrl-C is seen and the pace is kept.
void run_paced(runtime::Runtime<board::sim::SimBoard>& runtime, const Options& options) {
    board::sim::SimBoard& board = runtime.board();
    const Instant begin = board.now();
    const Instant end = begin + from_seconds(options.length_s);
    const auto wall_begin = std::chrono::steady_clock::now();
    while (board.now() < end && !board.stopped() && !interrupted) {
        runtime.run(std::min(end, board.now() + 10ms));
        if (options.speed <= 0) continue;
        const double due_s = to_seconds(board.now() - begin) / options.speed;
        std::this_thread::sleep_until(wall_begin + std::chrono::duration_cast<std::chrono::nanoseconds>(
                                                       std::chrono::duration<double>(due_s)));
    }
    board.request_stop();
    runtime.run(board.now() + 1s);  // what has not ended by then is hung
    if (!board.stopped()) board.force_safe_states();
}

int run(const Options& options) {
    std::unique_ptr<apps::ChromeTrace> trace;
    if (!options.trace_path.empty()) {
        auto created = apps::ChromeTrace::create(options.trace_path);
        if (!created)
            return std::fprintf(stderr, "%s\n", std::string(created.error().message.view()).c_str()), 1;
        trace = std::move(created.value());
    }
    board::NoPeripherals nothing_wired;
    board::sim::SimBoard board(options.machine, nothing_wired, trace.get());
    runtime::Runtime<board::sim::SimBoard> runtime(board, {.enforce_admission = options.enforce_admission});
    port::bind(&runtime);
    if (Result<void> begun = runtime.begin(runtime::sketch_table()); !begun)
        return refuse(runtime, begun.error());
    std::fputs(std::string(runtime.plan().admission_table().view()).c_str(), stderr);

    run_paced(runtime, options);
    port::bind(nullptr);
    std::fputs(apps::loop_table(apps::loops_of(runtime)).c_str(), stderr);
    std::fprintf(stderr, "%.6f s, trace hash %016llx\n", to_seconds(board.now() - kEpoch),
                 static_cast<unsigned long long>(board.trace_hash()));
    if (trace && !trace->finish(board.now()))
        return std::fputs("the trace could not be written\n", stderr), 1;
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    Options options;
    CLI::App app("This sketch, in the simulator: virtual time, the same every time.");
    app.footer(
        "Example: blink-sim --for 5 --trace blink.json     (open the trace in ui.perfetto.dev)\n"
        "Ends with 2 when admission refuses the sketch.");
    app.add_option("--for", options.length_s, "Virtual seconds to run")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    app.add_option("--speed", options.speed, "Virtual seconds per second; 0: as fast as it goes")
        ->check(CLI::NonNegativeNumber)
        ->capture_default_str();
    app.add_option("--cores", options.machine.cores, "Cores of the machine")
        ->check(CLI::Range(1, 64))
        ->capture_default_str();
    app.add_option("--seed", options.machine.seed, "Seed of what is random")->capture_default_str();
    app.add_option("--trace", options.trace_path, "Write a Chrome/Perfetto trace here");
    app.add_flag("!--no-admission", options.enforce_admission, "Run even what admission refuses");
    CLI11_PARSE(app, argc, argv);
    std::signal(SIGINT, [](int) { interrupted = true; });
    std::signal(SIGTERM, [](int) { interrupted = true; });
    return run(options);
}
