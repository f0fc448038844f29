#include "apps/qduino/commands.h"

#include <stdlib.h>
#include <unistd.h>

#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <utility>
#include <vector>

#include "apps/board_file/board_file.h"
#include "apps/doctor/doctor.h"
#include "apps/qduino/child_process.h"
#include "apps/qduino/completion.h"
#include "apps/qduino/kernel_trace.h"
#include "apps/qduino/new_sketch.h"
#include "apps/qduino/sketch_build.h"
#include "apps/terminal/human.h"
#include "apps/terminal/message.h"
#include "apps/terminal/program.h"
#include "board/linux/budget_keeper.h"
#include "board/linux/machine_settings.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

constexpr Fail fail{"qduino: "};

/// A number as the programs' own parsers read it back.
std::string text_of(double number) {
    char text[40];
    std::snprintf(text, sizeof text, "%.17g", number);
    return text;
}

Result<Sdk> sdk_of_this_program() {
    std::error_code failed;
    const char* home = std::getenv("QDUINO_HOME");
    const Result<fs::path> file = find_sdk({.home = home ? home : "",
                                            .program = fs::read_symlink("/proc/self/exe", failed),
                                            .built_in = QDUINO_SDK_FILE});
    if (!file) return file.error();
    return read_sdk(*file);
}

/// A sketch, made into the programs of some boards.
struct Built {
    Sdk sdk;
    Sketch sketch;
    std::vector<fs::path> programs;  ///< in the order of the boards
    int steps = 0;                   ///< that had to be made
};

Result<Built> build_sketch(const Arguments& arguments, const std::vector<BoardKind>& boards) {
    Result<Sdk> sdk = sdk_of_this_program();
    if (!sdk) return sdk.error();
    Result<Sketch> sketch = find_sketch(arguments.sketch);
    if (!sketch) return sketch.error();
    const Result<SketchBuild> build = SketchBuild::open(*sdk, *sketch, environment_of_this_process());
    if (!build) return build.error();
    const Result<int> made = build->make(boards, arguments.verbose);
    if (!made) return made.error();
    Built built{.sdk = std::move(*sdk), .sketch = std::move(*sketch), .programs = {}, .steps = *made};
    for (const BoardKind board : boards) built.programs.push_back(build->program(board));
    return built;
}

/// The error in a board file, before anything is compiled. Empty: it is right, or none was named.
std::string board_error(const Arguments& arguments) {
    return arguments.board.empty() ? "" : read_board_file(arguments.board).error;
}

int make_new(const Arguments& arguments) {
    const Result<fs::path> made = make_sketch(arguments.name);
    if (!made) return fail(made.error().message);
    std::printf("%s\n", made->c_str());
    return 0;
}

int build(const Arguments& arguments) {
    std::vector<BoardKind> boards{BoardKind::sim, BoardKind::linux};
    if (!arguments.only.empty()) boards = {arguments.only == "sim" ? BoardKind::sim : BoardKind::linux};
    const Result<Built> built = build_sketch(arguments, boards);
    if (!built) {
        fail(built.error().message);
        say(verdict("nothing was built."));
        return 1;
    }
    for (fs::path program : built->programs) {
        if (!arguments.output.empty()) {
            const fs::path copy = fs::path(arguments.output) / program.filename();
            std::error_code failed;
            fs::create_directories(arguments.output, failed);
            fs::copy_file(program, copy, fs::copy_options::overwrite_existing, failed);
            if (failed) return fail("cannot write " + copy.string() + ": " + failed.message());
            program = copy;
        }
        std::printf("%s\n", program.c_str());
    }
    std::fflush(stdout);
    say(verdict(built->sketch.name + (built->steps == 0
                                          ? " is up to date."
                                          : " is built: " + counted(built->steps, "step") + ".")));
    return 0;
}

Words simulated_machine(const Arguments& arguments) {
    Words words;
    const auto add = [&words](const char* name, const std::string& value) {
        words.emplace_back(name);
        words.push_back(value);
    };
    if (!arguments.board.empty()) add("--board", arguments.board);
    if (arguments.cores) add("--cores", std::to_string(*arguments.cores));
    if (arguments.seed) add("--seed", std::to_string(*arguments.seed));
    return words;
}

/// Builds the simulator's program and becomes it, with `words` behind the description of the
/// machine.
int become_simulation(const Arguments& arguments, const Words& words) {
    if (const std::string wrong = board_error(arguments); !wrong.empty()) return fail(wrong);
    const Result<Built> built = build_sketch(arguments, {BoardKind::sim});
    if (!built) return fail(built.error().message);
    Words command{built->programs[0].string()};
    for (const Words& more : {simulated_machine(arguments), words})
        command.insert(command.end(), more.begin(), more.end());
    return fail(become(command).message);
}

int sim(const Arguments& arguments) {
    Words words;
    if (arguments.length_s) words.insert(words.end(), {"--for", text_of(*arguments.length_s)});
    if (arguments.speed) words.insert(words.end(), {"--speed", text_of(*arguments.speed)});
    if (!arguments.report.empty()) words.insert(words.end(), {"--report", arguments.report});
    return become_simulation(arguments, words);
}

int check(const Arguments& arguments) {
    Words words{"--check"};
    if (arguments.json) words.emplace_back("--json");
    return become_simulation(arguments, words);
}

Result<std::string> trace_file(const Arguments& arguments) {
    if (!arguments.output.empty()) return arguments.output;
    const Result<Sketch> sketch = find_sketch(arguments.sketch);
    if (!sketch) return sketch.error();
    return sketch->name + "-trace.json";
}

int trace_simulation(const Arguments& arguments) {
    const Result<std::string> output = trace_file(arguments);
    if (!output) return fail(output.error().message);
    Words words{"--trace", *output};
    if (arguments.length_s) words.insert(words.end(), {"--for", text_of(*arguments.length_s)});
    return become_simulation(arguments, words);
}

/// A folder in memory for a run's pins: memory that several processes map must never wait for a
/// disk. Removed when the run is over.
class PinsFolder {
  public:
    PinsFolder() {
        std::string pattern = "/dev/shm/qduino-XXXXXX";
        if (::mkdtemp(pattern.data())) path_ = pattern;
    }
    PinsFolder(const PinsFolder&) = delete;
    PinsFolder& operator=(const PinsFolder&) = delete;
    ~PinsFolder() {
        std::error_code ignored;
        if (!path_.empty()) fs::remove_all(path_, ignored);
    }
    [[nodiscard]] bool valid() const { return !path_.empty(); }
    [[nodiscard]] std::string pins() const { return path_ + "/pins"; }

  private:
    std::string path_;
};

/// The sketch's own part of the command line.
Words sketch_words(const Arguments& arguments, const std::string& program, const std::string& pins) {
    Words words{program};
    if (arguments.length_s) words.insert(words.end(), {"--for", text_of(*arguments.length_s)});
    if (!arguments.board.empty()) words.insert(words.end(), {"--board", arguments.board});
    if (!pins.empty()) words.insert(words.end(), {"--pins", pins});
    if (!arguments.report.empty()) words.insert(words.end(), {"--report", arguments.report});
    if (arguments.isolate) words.emplace_back("--isolate");
    if (arguments.best_effort) words.emplace_back("--best-effort");
    return words;
}

bool names_real_devices(const board::linux::LinuxConfig& board) {
    return !board.gpio.empty() || !board.pwm.empty() || !board.analog.empty() || !board.i2c.empty() ||
           !board.spi.empty();
}

/// An ordinary process may be kept from running for longer than the supervisor waits for a
/// real-time one, and is not hung for that.
constexpr const char* kPatienceMs = "10000";

/// Runs a built sketch on Linux, under the supervisor where there is one, to its end. Returns its
/// exit status.
Result<int> run_on_linux(const Arguments& arguments, const Built& built,
                         const board::linux::LinuxConfig& board) {
    std::string pins = arguments.pins.empty() ? board.pins_path : arguments.pins;
    const std::string program = built.programs[0].string();
    if (!fs::exists(built.sdk.supervisor)) {
        say("no qduino-supervisor: safe states hold only as long as the sketch lives", "qduino: ");
        return run_in_front(sketch_words(arguments, program, pins));
    }
    PinsFolder folder;
    Words command{built.sdk.supervisor.string(), "--settings-state", board.settings_state};
    if (arguments.best_effort || !board.real_time)
        command.insert(command.end(), {"--timeout-ms", kPatienceMs});
    if (pins.empty()) {
        if (!folder.valid()) {
            return make_error(ErrorCode::not_permitted,
                              "cannot make a folder in /dev/shm for the sketch's pins");
        }
        std::fputs(names_real_devices(board)
                       ? "Pins that the board file does not name are connected to nothing.\n"
                       : "No pins are named: all are connected to nothing (--board names real ones,\n"
                         "--pins those of a virtual machine).\n",
                   stderr);
        pins = folder.pins();
        command.emplace_back("--make-pins");
    }
    command.insert(command.end(), {"--pins", pins, "--"});
    const Words sketch = sketch_words(arguments, program, pins);
    command.insert(command.end(), sketch.begin(), sketch.end());
    return run_in_front(command);
}

/// The [linux] side of the board file; the default board when none is named. False: it is wrong,
/// and `error` says where.
bool read_linux_board(const Arguments& arguments, board::linux::LinuxConfig& board, std::string& error) {
    if (arguments.board.empty()) return true;
    ReadBoardFile read = read_board_file(arguments.board);
    error = read.error;
    board = std::move(read.board.linux);
    return error.empty();
}

/// The result of a run. The sketch's own report has already said how its loops kept their periods.
std::string end_of(const std::string& name, int status) {
    if (status == 0) return name + " ran to its end.";
    if (status == 2) return name + " is REFUSED: no loop of it ran.";
    if (status > 128) {
        const char* signal = ::strsignal(status - 128);
        return name + " DIED of signal " + std::to_string(status - 128) + " (" +
               (signal ? signal : "unknown") + ").";
    }
    return name + " FAILED with status " + std::to_string(status) + ".";
}

int run(const Arguments& arguments) {
    board::linux::LinuxConfig board;
    std::string wrong;
    if (!read_linux_board(arguments, board, wrong)) return fail(wrong);
    const Result<Built> built = build_sketch(arguments, {BoardKind::linux});
    if (!built) return fail(built.error().message);
    const Result<int> status = run_on_linux(arguments, *built, board);
    if (!status) return fail(status.error().message);
    say(verdict(end_of(built->sketch.name, *status)));
    return *status;
}

int write_trace(KernelTraceReader& reader, const std::string& path) {
    std::ofstream file(path);
    file << reader.chrome_json() << std::flush;
    if (!file) return fail("the trace cannot be written: " + path);
    std::fprintf(stderr,
                 "trace: %s\n"
                 "  (open it in ui.perfetto.dev or chrome://tracing): %d stretches of loops, wakes,\n"
                 "preemption, throttling and interrupts, as the kernel saw them. Not in it: where a\n"
                 "release begins in a loop that spins on its own core, and overruns (counted above).\n",
                 path.c_str(), reader.stretches());
    if (reader.lost() > 0) {
        std::fprintf(stderr, "The oldest %lld events did not fit the kernel's buffer: trace for less time.\n",
                     static_cast<long long>(reader.lost()));
    }
    return 0;
}

constexpr double kTraceSeconds = 10;

int trace_on_linux(Arguments arguments) {
    board::linux::LinuxConfig board;
    std::string wrong;
    if (!read_linux_board(arguments, board, wrong)) return fail(wrong);
    const Result<std::string> output = trace_file(arguments);
    if (!output) return fail(output.error().message);
    if (!arguments.length_s) arguments.length_s = kTraceSeconds;
    const Result<Built> built = build_sketch(arguments, {BoardKind::linux});
    if (!built) return fail(built.error().message);
    Result<KernelTracer> tracer = KernelTracer::start();
    if (!tracer) return fail(tracer.error().message);
    const Result<int> status = run_on_linux(arguments, *built, board);
    if (!status) return fail(status.error().message);
    if (*status == 2) return 2;  // refused: there was nothing to record
    KernelTraceReader reader(board::linux::BudgetKeeper::signal_number(), ::getpid());
    if (auto stopped = tracer->stop(reader); !stopped) return fail(stopped.error().message);
    const int written = write_trace(reader, *output);
    return *status != 0 ? *status : written;
}

int trace(const Arguments& arguments) {
    return arguments.on_linux ? trace_on_linux(arguments) : trace_simulation(arguments);
}

int restore(const Arguments& arguments) {
    const auto restored = board::linux::restore_settings(arguments.settings_state);
    if (!restored) return fail(restored.error().message);
    std::printf(*restored == board::linux::Restored::undone
                    ? "What a dead sketch had changed on this machine is as it was before.\n"
                    : "Nothing to undo: no sketch has left this machine changed.\n");
    return 0;
}

}  // namespace

int run_command(const Arguments& arguments, const CLI::App& parser) {
    switch (arguments.command) {
        case Command::none:
            break;
        case Command::make_new:
            return make_new(arguments);
        case Command::build:
            return build(arguments);
        case Command::run:
            return run(arguments);
        case Command::sim:
            return sim(arguments);
        case Command::check:
            return check(arguments);
        case Command::trace:
            return trace(arguments);
        case Command::doctor:
            return run_doctor({.json = arguments.json, .root = {}}, stdout);
        case Command::restore:
            return restore(arguments);
        case Command::completion:
            std::fputs(completion_script(parser, arguments.shell).c_str(), stdout);
            return 0;
    }
    return 1;
}

}  // namespace qduino::apps
