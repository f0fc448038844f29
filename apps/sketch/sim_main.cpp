// main() of a sketch in the simulator: runs the sketch in virtual time and reports how its loops
// kept their periods. With --check it only reports the verdict of admission.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <functional>
#include <sstream>
#include <thread>

#include "apps/sketch/prompt_stop.h"
#include "apps/sketch/sketch_main.h"
#include "board/sim/endless_jump.h"
#include "board/sim/sim_board.h"
#include "config/board_file.h"
#include "config/parts.h"
#include "posix/signal_stack.h"
#include "posix/small_file.h"
#include "report/admission_report.h"
#include "report/certificate.h"
#include "report/chain_report.h"
#include "report/chrome_trace.h"
#include "report/code_place.h"
#include "report/crash_report.h"
#include "report/lock_report.h"
#include "report/picture/page.h"
#include "report/picture/picture_file.h"
#include "report/picture/strip.h"
#include "report/pin/pin_witness.h"
#include "report/plan_picture.h"
#include "report/schedule_trace.h"
#include "report/sketch_report.h"
#include "report/spin_report.h"
#include "terminal/colour.h"
#include "terminal/command_line.h"
#include "terminal/message.h"
#include "terminal/program.h"

namespace {

using namespace qduino;
using runtime::Runtime;

/// The limit on setup() during --check: some sketches wait there for input that does not come.
/// Where it does not even come back to the board, twice that.
constexpr unsigned kSetupSeconds = 10;

struct Options : apps::SketchOptions {
    double speed = 0;  // virtual seconds per second; 0: as fast as it goes
    std::string trace_path;
    std::string picture_path;
    apps::PictureWindow picture;
    std::string vcd_path;               // empty: no dump of the pins
    bool plain = false;                 // reports without the strips of blocks
    std::optional<int> cores;           // these two overrule the board file
    std::optional<std::uint64_t> seed;  //
    bool enforce_admission = true;
    bool check = false;
    bool json = false;
    std::string certificate_path;  // empty: none
    std::string sources;           // of the sketch, a line each: the certificate binds them
    board::sim::SimConfig computer;
    std::vector<apps::PartSpec> parts;  // wired to it
};

constexpr apps::Fail fail{""};

/// In slices, so that Ctrl-C is seen and the pace is kept, for as long as was asked for.
/// `go_on(until)` is false when it has come to its end before that; so is the result.
bool run_paced(board::sim::SimBoard& board, const Options& options,
               const std::function<bool(Instant until)>& go_on) {
    const Instant begin = board.now();
    const Instant end = begin + from_seconds(options.length_s);
    // A run of weeks is not looked at ten times a second.
    const Nanoseconds slice =
        options.speed > 0 ? 10ms : std::clamp<Nanoseconds>((end - begin) / 10'000, 100ms, 1s);
    const auto wall_begin = std::chrono::steady_clock::now();
    while (board.now() < end && !apps::stop_asked()) {
        if (!go_on(std::min(end, board.now() + slice))) return false;
        if (options.speed <= 0) continue;
        const double due_s = to_seconds(board.now() - begin) / options.speed;
        std::this_thread::sleep_until(wall_begin + std::chrono::duration_cast<std::chrono::nanoseconds>(
                                                       std::chrono::duration<double>(due_s)));
    }
    return true;
}

// ---- the last resort: code outside of the sketch that does not come back ------------------------

/// What has not ended after a virtual second, or after this, is hung.
constexpr auto kEndsWithin = std::chrono::milliseconds{400};

/// Runs the loops to their end. A stop interrupts them again and again (prompt_stop.h).
void run_to_the_end(board::sim::SimBoard& board, Runtime& runtime) {
    const auto limit = std::chrono::steady_clock::now() + kEndsWithin;
    const Instant end = board.now() + 1s;
    do {
        runtime.run(end);
    } while (!board.stopped() && board.now() < end && std::chrono::steady_clock::now() < limit);
}

/// Says where the code is, and ends the program without its reports. In a signal's handler: if the
/// code was in the memory allocator, this waits for ever, and the alarm ends it.
[[noreturn]] void give_up_at(const void* place) {
    std::signal(SIGALRM, SIG_DFL);
    ::alarm(1);
    const void* const after[] = {static_cast<const char*>(place) + 1};
    apps::say(apps::verdict("the sketch does not come back from code that is not its own, at " +
                            apps::place_of(after) + ": ended by force."));
    ::_exit(1);
}

void give_up_after_stop() {
    constexpr char kText[] = "Verdict: the sketch waits outside of virtual time: ended by force.\n";
    static_cast<void>(!::write(STDERR_FILENO, kText, sizeof kText - 1));
    ::_exit(1);
}

board::sim::SimBoard* crashing_board = nullptr;

void end_with_words(int signal, siginfo_t* info, void* context) {
    crashing_board->force_safe_states();
    apps::settle_sketch_output();
    apps::say_crash(apps::name_of_vcpu(crashing_board->current_vcpu()), signal, info, context);
    ::_exit(1);
}

/// While it lives, a crash of the sketch ends the program with the line and the cause. On the
/// thread that runs the board.
class CrashWords {
  public:
    explicit CrashWords(board::sim::SimBoard& board) {
        crashing_board = &board;
        struct sigaction action {};
        action.sa_sigaction = &end_with_words;
        action.sa_flags = SA_SIGINFO | SA_ONSTACK | static_cast<int>(SA_RESETHAND);
        for (std::size_t i = 0; i < kSignals.size(); ++i) ::sigaction(kSignals[i], &action, &before_[i]);
    }
    ~CrashWords() {
        for (std::size_t i = 0; i < kSignals.size(); ++i) ::sigaction(kSignals[i], &before_[i], nullptr);
    }
    CrashWords(const CrashWords&) = delete;
    CrashWords& operator=(const CrashWords&) = delete;

  private:
    static constexpr std::array kSignals{SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};
    posix::SignalStack stack_;
    std::array<struct sigaction, kSignals.size()> before_{};
};

/// Writes the picture, if one is asked for. Returns what to say of it.
Result<std::string> draw_to(const std::string& path, const apps::picture::Schedule& schedule) {
    if (path.empty()) return std::string{};
    if (schedule.until - schedule.from == Nanoseconds{1})
        return make_error(ErrorCode::out_of_range,
                          "there is nothing to draw: the run ended before the picture begins");
    if (schedule.cores.empty()) return std::string{"no picture: no loop stands on a core\n"};
    QDUINO_TRY(apps::picture::write_picture(path, apps::picture::svg_page(schedule)));
    return "picture: " + path + "\n";
}

/// What is recorded of a run, for files and for the terminal.
struct Records {
    std::unique_ptr<apps::ChromeTrace> trace;  // null: none is asked for
    apps::ScheduleTrace schedule;
    apps::PinWitness pins{kEpoch};
};

/// In the simulator a loop takes time only where something asks for it.
constexpr std::string_view kBarsAreEmpty =
    "The bars of the loops are empty: in the simulator code takes no time but for spins, and what a board "
    "file says that calls cost.";

/// The run's schedule, with R against T. Its title and its remark say what it is.
apps::picture::Schedule schedule_of(const Options& options, Records& records, const runtime::Plan& plan,
                                    Instant now) {
    apps::picture::Schedule schedule = records.schedule.finish(now);
    schedule.title = options.name + " in the simulator";
    const Nanoseconds from = schedule.from - kEpoch, until = schedule.until - kEpoch;
    schedule.remark = from == Nanoseconds{0} ? text<std::string>("The first ", until)
                                             : text<std::string>("From ", from, " to ", until);
    write(schedule.remark, " of ", now - kEpoch, " of virtual time, with seed ", options.computer.seed,
          ". The longest responses are those of the whole run.");
    if (!apps::picture::anything_ran(schedule)) write(schedule.remark, ' ', kBarsAreEmpty);
    schedule.responses = apps::responses_of(plan);
    apps::add_seen(schedule, schedule.responses);
    records.pins.add_rows(schedule, kEpoch, !options.picture.length_s);
    return schedule;
}

/// Writes the changes of the pins, if they are asked for. Returns what to say of it.
Result<std::string> dump_to(const Options& options, Records& records) {
    if (options.vcd_path.empty()) return std::string{};
    QDUINO_TRY(records.pins.write_dump(options.vcd_path));
    return "pins: " + options.vcd_path + "\n  (open it in GTKWave or PulseView)\n";
}

int report_end(const Options& options, board::sim::SimBoard& board,
               const std::vector<const runtime::Loop*>& loops, Records& records) {
    std::string report = apps::loop_table(loops);
    const runtime::Plan& plan = Runtime::current()->plan();
    const apps::picture::Schedule schedule = schedule_of(options, records, plan, board.now());
    if (!options.plain) {
        const std::string strip = apps::picture::strip(schedule, apps::picture::signs_of_terminal(),
                                                       apps::wants_colour(STDERR_FILENO));
        if (!strip.empty()) report += "\n" + strip;
        if (!apps::picture::anything_ran(schedule)) write(report, '\n', kBarsAreEmpty, '\n');
    }
    if (const std::string pins = records.pins.sentences(); !pins.empty()) report += "\n" + pins;
    char hash[20];
    std::snprintf(hash, sizeof hash, "%016llx", static_cast<unsigned long long>(board.trace_hash()));
    write(report, "\n", Fixed{to_seconds(board.now() - kEpoch), 6}, " s, trace hash ", hash, "\n");
    const bool written = !records.trace || records.trace->finish(board.now()).ok();
    if (records.trace && written)
        write(report, "trace: ", options.trace_path,
              "\n  (open it in ui.perfetto.dev or chrome://tracing)\n");
    const Result<std::string> picture = draw_to(options.picture_path, schedule);
    if (picture) report += *picture;
    const Result<std::string> dump = dump_to(options, records);
    if (dump) report += *dump;
    if (const std::string chains = apps::chain_lines(*Runtime::current()); !chains.empty())
        report += "\n" + chains;
    apps::report_beside_sketch(report);
    if (!written) return fail("the trace could not be written");
    if (!picture) return fail(picture.error());
    if (!dump) return fail(dump.error());
    const auto spins = board.spins();
    if (const std::string notes = apps::spin_notes(spins); !notes.empty()) apps::report_beside_sketch(notes);
    const std::string beyond = apps::chain_verdict(*Runtime::current());
    apps::say(apps::verdict(options.name + ": " + apps::spin_verdict(spins) +
                            apps::periods_kept(loops, board.now()) +
                            apps::sleep_verdict(*Runtime::current()) +
                            apps::lock_verdict(*Runtime::current(), runtime::sketch_table()) + beyond + "."));
    return beyond.empty() ? 0 : 1;
}

/// The end of a sketch whose setup() has not ended: no loop has run.
int report_setup(const Options& options, board::sim::SimBoard& board, Nanoseconds after, Records& records) {
    if (records.trace && !records.trace->finish(board.now()).ok())
        return fail("the trace could not be written");
    if (const std::string pins = records.pins.sentences(); !pins.empty()) apps::report_beside_sketch(pins);
    if (const Result<std::string> dump = dump_to(options, records); !dump) return fail(dump.error());
    apps::say(apps::verdict(options.name + ": " + apps::setup_verdict(board.spins(), after) +
                            ". No loop of it ran."));
    return 0;
}

/// What the parts did; their pictures are written.
int report_parts(const apps::Parts& parts, Instant now) {
    if (const std::string lines = parts.report(now); !lines.empty()) apps::report_beside_sketch(lines);
    const Result<void> finished = parts.finish();
    return finished ? 0 : fail(finished.error());
}

int run(const Options& options) {
    Records records;
    if (!options.trace_path.empty()) {
        auto created = apps::ChromeTrace::create(options.trace_path);
        if (!created) return fail(created.error());
        records.trace = std::move(*created);
    }
    apps::TwoSinks sinks(records.trace.get(), &records.schedule);
    apps::Parts parts(options.parts);
    records.pins.forward_to(parts);
    records.pins.rows_from(from_seconds(options.picture.from_s));
    if (!options.vcd_path.empty()) {
        if (const Result<void> kept = records.pins.keep_dump(); !kept) return fail(kept.error());
    }
    board::sim::SimBoard board(options.computer, records.pins, &sinks);
    apps::stop_on_signals();
    apps::PromptStop stop(board.event_loop(), give_up_after_stop);
    apps::SketchCourse course;
    course.refused = apps::verdict(options.name + " is REFUSED: no loop of it ran.");
    course.runtime.enforce_admission = options.enforce_admission;
    course.runtime.measure_locks = true;  // virtual time: it costs nothing
    course.opening = [] { return std::string{}; };
    Nanoseconds in_setup{-1};  // −1: it has ended
    course.setup = [&](void (*setup)()) {
        if (!run_paced(board, options, [&](Instant until) { return !board.run_setup(setup, until); }))
            return true;
        in_setup = board.now() - kEpoch;
        return false;
    };
    course.play = [&](Runtime& runtime) {
        const Instant from = kEpoch + from_seconds(options.picture.from_s);
        records.schedule.follow(runtime, from, from + apps::length_for(runtime.plan(), options.picture));
        run_paced(board, options, [&](Instant until) {
            runtime.run(until);
            return !board.stopped();
        });
    };
    course.stop = [&](Runtime& runtime) {
        records.pins.end(board.now());
        board.request_stop();
        run_to_the_end(board, runtime);
        if (!board.stopped()) board.force_safe_states();
        stop.dismiss();
    };
    course.report = [&](const auto& loops) {
        if (const int status = report_parts(parts, board.now())) return status;
        return in_setup < Nanoseconds{0} ? report_end(options, board, loops, records)
                                         : report_setup(options, board, in_setup, records);
    };
    const board::sim::EndlessJumps jumps(board.event_loop(), give_up_at);
    const CrashWords crashes(board);
    return apps::run_sketch(board, options, course);
}

/// Sends the sketch's output in setup() to stderr, since stdout is the report's. Returns where the
/// report goes.
std::FILE* take_stdout() {
    const int report = ::dup(STDOUT_FILENO);
    ::dup2(STDERR_FILENO, STDOUT_FILENO);
    return report >= 0 ? ::fdopen(report, "w") : nullptr;
}

constexpr const char* kSetupDoesNotEnd =
    "setup() does not end with nothing wired to the board: admission cannot be checked without running it";

void give_up_on_setup(int) {
    static_cast<void>(!::write(STDERR_FILENO, kSetupDoesNotEnd, std::strlen(kSetupDoesNotEnd)));
    static_cast<void>(!::write(STDERR_FILENO, "\n", 1));
    ::_exit(1);
}

/// The board on which setup() runs for a check. A table's setup() has no argument.
board::sim::SimBoard* checked_board = nullptr;

/// For kSetupSeconds of real time at most: the input that it waits for may come.
void run_checked_setup() {
    const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds{kSetupSeconds};
    while (!checked_board->run_setup(runtime::sketch_table().setup, checked_board->now() + 1s)) {
        const auto spins = checked_board->spins();
        const bool hopeless = !spins.empty() && spins.front().spin.endless;
        if (!hopeless && std::chrono::steady_clock::now() < limit) continue;
        fail(kSetupDoesNotEnd);
        apps::say(apps::setup_verdict(spins, checked_board->now() - kEpoch) + ".\n");
        apps::settle_sketch_output();
        std::_Exit(1);
    }
}

/// The worst schedule, for a picture or for the terminal. Empty where nobody asks for it and it
/// would take more than some milliseconds. Error: it would take minutes.
Result<apps::picture::Schedule> worst_schedule(const Options& options, const runtime::Plan& plan) {
    constexpr std::int64_t kQuick = 10'000, kMost = 1'000'000;
    const std::int64_t periods = apps::periods_until_end(plan, options.picture);
    const bool asked = !options.picture_path.empty();
    if (asked && periods > kMost) {
        return make_error(ErrorCode::out_of_range,
                          "the picture of a check ends after a million periods of the shortest "
                          "loop at most, and this would end after ",
                          periods,
                          ": take an earlier --from or a shorter "
                          "--length");
    }
    const bool shown =
        !options.json && periods <= kQuick && plan.admission().placed.size() <= apps::picture::kStripRows;
    if (!asked && !shown) return apps::picture::Schedule{};
    return apps::critical_schedule(plan, options.name, options.picture);
}

/// The whole answer of --check.
std::string verdict_text(const Options& options, const runtime::Plan& plan, const runtime::SketchTable& table,
                         const apps::CheckedBoard& checked, const apps::picture::Schedule& schedule,
                         bool colours) {
    if (options.json) return apps::admission_json(plan, table, checked) + "\n";
    std::string strip;
    if (!options.plain) strip = apps::picture::strip(schedule, apps::picture::signs_of_terminal(), colours);
    if (!strip.empty()) strip = "\nThe worst case, all released together:\n" + strip;
    return apps::with_outcomes(apps::admission_text(plan, table, checked) +
                                   apps::lock_assumptions(*Runtime::current(), table),
                               colours) +
           strip + "\n" +
           apps::verdict(
               apps::admission_verdict(plan, checked, apps::lock_condition(*Runtime::current(), table)),
               colours);
}

Result<void> write_certificate(const Options& options, const Runtime& runtime) {
    apps::CertifiedTexts texts{
        .sketch = options.name,
        .sources = {},
        .board = options.board_path,
        .locks_that_say_nothing = apps::locks_that_say_nothing(runtime, runtime::sketch_table())};
    std::istringstream lines(options.sources);
    for (std::string line; std::getline(lines, line);) texts.sources.emplace_back(line);
    QDUINO_TRY_ASSIGN(const std::string certificate, apps::certificate_json(runtime.plan(), texts));
    return posix::write_file(options.certificate_path, certificate);
}

/// Admission alone: no loop runs. setup() runs where it may declare I/O VCPUs.
int check(const Options& options) {
    std::FILE* const report = take_stdout();
    if (!report) return fail("standard output is closed: the table has nowhere to go");
    apps::Parts parts(options.parts);
    board::sim::SimBoard board(options.computer, parts);
    Runtime runtime(board);
    const runtime::SketchTable& table = runtime::sketch_table();
    checked_board = &board;
    const bool runs_setup = table.setup && apps::setup_may_declare();
    const board::sim::EndlessJumps jumps(board.event_loop(), nullptr);
    const CrashWords crashes(board);
    std::signal(SIGALRM, give_up_on_setup);
    ::alarm(2 * kSetupSeconds);
    const Result<void> begun = runtime.begin(table, runs_setup ? &run_checked_setup : nullptr);
    ::alarm(0);
    apps::settle_sketch_output();

    const runtime::Plan& plan = runtime.plan();
    const apps::CheckedBoard checked{.sketch = options.name,
                                     .board_file = options.board_path,
                                     .cores = options.computer.cores,
                                     .setup_ran = runs_setup,
                                     .locks_that_say_nothing = apps::locks_that_say_nothing(runtime, table)};
    const Result<apps::picture::Schedule> schedule = worst_schedule(options, plan);
    if (!schedule) return fail(schedule.error());
    const Result<std::string> picture = draw_to(options.picture_path, *schedule);
    std::fputs(
        verdict_text(options, plan, table, checked, *schedule, apps::wants_colour(::fileno(report))).c_str(),
        report);
    if (std::fclose(report) != 0) return fail("the table could not be written");
    if (!picture) return fail(picture.error());
    if (!picture->empty()) std::fputs(picture->c_str(), stderr);
    // Admission agreed, and the board refused.
    if (plan.admitted() && !begun) return fail(begun.error());
    if (!plan.admitted()) return 2;
    if (options.certificate_path.empty()) return 0;
    const Result<void> written = write_certificate(options, runtime);
    return written ? 0 : fail(written.error());
}

/// The simulated computer of the board file, or the default one, with the changes of the command
/// line.
std::string read_computer(Options& options) {
    if (!options.board_path.empty()) {
        apps::ReadBoardFile read = apps::read_board_file(options.board_path);
        if (!read.ok()) return read.error;
        options.computer = std::move(read.board.sim);
        options.parts = std::move(read.board.parts);
    }
    if (options.cores) options.computer.cores = *options.cores;
    if (options.seed) options.computer.seed = *options.seed;
    return apps::why_cores_do_not_fit(options.computer);
}

void add_options(apps::CommandLine& line, Options& options) {
    options.length_s = 10;
    apps::add_sketch_options(line, options, "Virtual seconds to run (default 10)",
                             "Board file: the [sim] table")
        .positive();
    line.option("--speed", options.speed, "Virtual seconds per second; 0: as fast as it goes")
        .called("K")
        .not_negative();
    line.option("--cores", options.cores, "Cores of the computer, 1 to 64 (default 2)")
        .called("N")
        .within(1, 64);
    line.option("--seed", options.seed, "Seed of what is random (default 1)").called("N");
    line.option("--trace", options.trace_path, "Write a Chrome/Perfetto trace here").called("FILE");
    line.option("--picture", options.picture_path, "Draw the schedule here (.svg)").called("FILE");
    line.option("--from", options.picture.from_s, "It begins at this second")
        .called("S")
        .within(0.0, apps::picture::kLatestStart);
    line.option("--length", options.picture.length_s, "It shows so many seconds")
        .called("S")
        .within(1e-6, apps::picture::kLongest);
    line.option("--vcd", options.vcd_path, "Write what the pins did here, for GTKWave").called("FILE");
    line.flag("--plain", options.plain, "No strips of blocks: for a screen reader");
    line.flag("!--no-admission", options.enforce_admission, "Run even what admission refuses");
    const apps::CommandLine::Option only_check =
        line.flag("--check", options.check, "Say what admission makes of it");
    line.flag("--json", options.json, "With --check: as JSON").needs(only_check);
    line.option("--certificate", options.certificate_path, "With --check: what admission rests on")
        .called("FILE")
        .needs(only_check);
    line.option("--sources", options.sources, "The sketch's files, a line each, for the certificate")
        .called("FILES")
        .needs(only_check);
}

}  // namespace

int main(int argc, char** argv) {
    apps::keep_standard_descriptors();
    Options options;
    apps::CommandLine line{"This sketch, in the simulator: virtual time, the same every time.",
                           "Example: blink-sim --for 5 --trace blink.json    (open it in ui.perfetto.dev)\n"
                           "Ends with 2 when admission refuses the sketch."};
    add_options(line, options);
    if (const auto status = line.parse(argc, argv)) return *status;
    options.name = std::filesystem::path(argv[0]).filename().string();
    if (options.name.ends_with("-sim")) options.name.resize(options.name.size() - 4);
    if (const std::string wrong = read_computer(options); !wrong.empty()) return fail(wrong);
    if (!options.picture_path.empty()) {
        if (const auto named = apps::picture::check_picture_name(options.picture_path); !named)
            return fail(named.error());
    }
    if (options.check) return check(options);
    return run(options);
}
