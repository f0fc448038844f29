// main() of a sketch in the simulator: runs the sketch in virtual time and reports how its loops
// kept their periods. With --check it only reports the verdict of admission.
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <thread>

#include "apps/board_file/board_file.h"
#include "apps/command_line/command_line.h"
#include "apps/host/admission_report.h"
#include "apps/host/certificate.h"
#include "apps/host/chrome_trace.h"
#include "apps/host/sketch_main.h"
#include "apps/host/sketch_report.h"
#include "apps/terminal/message.h"
#include "apps/terminal/program.h"
#include "board/sim/sim_board.h"
#include "posix/small_file.h"

namespace {

using namespace qduino;
using runtime::Runtime;

/// The limit on setup() during --check: some sketches wait there for input that does not come.
constexpr unsigned kSetupSeconds = 10;

struct Options : apps::SketchOptions {
    double speed = 0;  // virtual seconds per second; 0: as fast as it goes
    std::string trace_path;
    std::optional<int> cores;           // these two overrule the board file
    std::optional<std::uint64_t> seed;  //
    bool enforce_admission = true;
    bool check = false;
    bool json = false;
    std::string certificate_path;  // empty: none
    std::string sketch;            // its name
    board::sim::SimConfig computer;
};

constexpr apps::Fail fail{""};

/// In slices of 10 ms, so that Ctrl-C is seen and the pace is kept.
void run_paced(Runtime& runtime, board::sim::SimBoard& board, const Options& options) {
    const Instant begin = board.now();
    const Instant end = begin + from_seconds(options.length_s);
    const auto wall_begin = std::chrono::steady_clock::now();
    while (board.now() < end && !board.stopped() && !apps::stop_asked()) {
        runtime.run(std::min(end, board.now() + 10ms));
        if (options.speed <= 0) continue;
        const double due_s = to_seconds(board.now() - begin) / options.speed;
        std::this_thread::sleep_until(wall_begin + std::chrono::duration_cast<std::chrono::nanoseconds>(
                                                       std::chrono::duration<double>(due_s)));
    }
}

int report_end(const Options& options, board::sim::SimBoard& board,
               const std::vector<const runtime::Loop*>& loops, apps::ChromeTrace* trace) {
    std::string report = apps::loop_table(loops);
    char hash[20];
    std::snprintf(hash, sizeof hash, "%016llx", static_cast<unsigned long long>(board.trace_hash()));
    write(report, "\n", Fixed{to_seconds(board.now() - kEpoch), 6}, " s, trace hash ", hash, "\n");
    const bool written = !trace || trace->finish(board.now()).ok();
    if (trace && written)
        write(report, "trace: ", options.trace_path,
              "\n  (open it in ui.perfetto.dev or chrome://tracing)\n");
    apps::report_beside_sketch(report);
    if (!written) return fail("the trace could not be written");
    apps::say(apps::verdict(options.sketch + ": " + apps::periods_kept(loops) + "."));
    return 0;
}

int run(const Options& options) {
    std::unique_ptr<apps::ChromeTrace> trace;
    if (!options.trace_path.empty()) {
        auto created = apps::ChromeTrace::create(options.trace_path);
        if (!created) return fail(created.error());
        trace = std::move(*created);
    }
    board::NoPeripherals nothing_wired;
    board::sim::SimBoard board(options.computer, nothing_wired, trace.get());
    apps::SketchCourse course;
    course.refused = apps::verdict(options.sketch + " is REFUSED: no loop of it ran.");
    course.runtime.enforce_admission = options.enforce_admission;
    course.opening = [] { return std::string{}; };
    course.play = [&](Runtime& runtime) { run_paced(runtime, board, options); };
    course.stop = [&](Runtime& runtime) {
        board.request_stop();
        runtime.run(board.now() + 1s);  // what has not ended by then is hung
        if (!board.stopped()) board.force_safe_states();
    };
    course.report = [&](const auto& loops) { return report_end(options, board, loops, trace.get()); };
    return apps::run_sketch(board, options, course);
}

/// Sends the sketch's output in setup() to stderr, since stdout is the report's. Returns where the
/// report goes.
std::FILE* take_stdout() {
    const int report = ::dup(STDOUT_FILENO);
    ::dup2(STDERR_FILENO, STDOUT_FILENO);
    return report >= 0 ? ::fdopen(report, "w") : nullptr;
}

void give_up_on_setup(int) {
    constexpr char kText[] =
        "setup() does not end with nothing wired to the board: admission cannot be checked without running "
        "it\n";
    static_cast<void>(!::write(STDERR_FILENO, kText, sizeof kText - 1));
    ::_exit(1);
}

/// Admission alone: no loop runs. setup() runs where it may declare I/O VCPUs.
int check(const Options& options) {
    std::FILE* const report = take_stdout();
    if (!report) return fail("standard output is closed: the table has nowhere to go");
    board::NoPeripherals nothing_wired;
    board::sim::SimBoard board(options.computer, nothing_wired);
    Runtime runtime(board);
    runtime::SketchTable table = runtime::sketch_table();
    if (!apps::setup_may_declare()) table.setup = nullptr;
    std::signal(SIGALRM, give_up_on_setup);
    ::alarm(kSetupSeconds);
    const Result<void> begun = runtime.begin(table);
    ::alarm(0);
    apps::settle_sketch_output();

    const runtime::Plan& plan = runtime.plan();
    const apps::CheckedBoard checked{.sketch = options.sketch,
                                     .board_file = options.board_path,
                                     .cores = options.computer.cores,
                                     .setup_ran = table.setup != nullptr};
    const std::string text = options.json ? apps::admission_json(plan, table, checked) + "\n"
                                          : apps::admission_text(plan, table, checked) + "\n" +
                                                apps::verdict(apps::admission_verdict(plan, checked));
    std::fputs(text.c_str(), report);
    if (std::fclose(report) != 0) return fail("the table could not be written");
    // Admission agreed, and the board refused.
    if (plan.admitted() && !begun) return fail(begun.error());
    if (!plan.admitted()) return 2;
    if (options.certificate_path.empty()) return 0;
    const Result<void> written =
        posix::write_file(options.certificate_path, apps::certificate_json(plan, options.sketch));
    return written ? 0 : fail(written.error());
}

/// The simulated computer of the board file, or the default one, with the changes of the command
/// line.
std::string read_computer(Options& options) {
    if (!options.board_path.empty()) {
        apps::ReadBoardFile read = apps::read_board_file(options.board_path);
        if (!read.ok()) return read.error;
        options.computer = std::move(read.board.sim);
    }
    if (options.cores) options.computer.cores = *options.cores;
    if (options.seed) options.computer.seed = *options.seed;
    return apps::why_cores_do_not_fit(options.computer);
}

void add_options(CLI::App& app, Options& options) {
    options.length_s = 10;
    apps::add_sketch_options(app, options, "Virtual seconds to run (default 10)", CLI::PositiveNumber,
                             "Board file: the [sim] table");
    apps::add_option(app, "--speed", options.speed, "Virtual seconds per second; 0: as fast as it goes", "K")
        ->check(CLI::NonNegativeNumber);
    apps::add_option(app, "--cores", options.cores, "Cores of the computer, 1 to 64 (default 2)", "N")
        ->check(CLI::Range(1, 64));
    apps::add_option(app, "--seed", options.seed, "Seed of what is random (default 1)", "N");
    apps::add_option(app, "--trace", options.trace_path, "Write a Chrome/Perfetto trace here", "FILE");
    app.add_flag("!--no-admission", options.enforce_admission, "Run even what admission refuses");
    CLI::Option* only_check = app.add_flag("--check", options.check, "Say what admission makes of it");
    app.add_flag("--json", options.json, "With --check: as JSON")->needs(only_check);
    apps::add_option(app, "--certificate", options.certificate_path, "With --check: what admission rests on",
                     "FILE")
        ->needs(only_check);
}

}  // namespace

int main(int argc, char** argv) {
    Options options;
    CLI::App app("This sketch, in the simulator: virtual time, the same every time.");
    app.footer(
        "Example: blink-sim --for 5 --trace blink.json    (open it in ui.perfetto.dev)\n"
        "Ends with 2 when admission refuses the sketch.");
    add_options(app, options);
    if (const auto status = apps::parse_command_line(app, argc, argv)) return *status;
    options.sketch = std::filesystem::path(argv[0]).filename().string();
    if (options.sketch.ends_with("-sim")) options.sketch.resize(options.sketch.size() - 4);
    if (const std::string wrong = read_computer(options); !wrong.empty()) return fail(wrong);
    if (options.check) return check(options);
    apps::stop_on_signals();
    return run(options);
}
