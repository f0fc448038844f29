#include "apps/sketch/sketch_main.h"

#include <poll.h>
#include <stdio_ext.h>
#include <unistd.h>

#include <cstdio>
#include <source_location>

#include "arduino/core/interrupts.h"
#include "posix/durable_file.h"
#include "report/guarantee_report.h"
#include "report/lock_report.h"
#include "report/profile_report.h"
#include "report/sketch_report.h"
#include "terminal/colour.h"
#include "terminal/message.h"
#include "terminal/program.h"

// A weak reference takes no member out of the Arduino archive. It is null unless the sketch, or a
// library that it uses, took that member.
namespace qduino::arduino {
[[gnu::weak]] bool interrupts_vcpu(DeviceClass device, Nanoseconds budget, Nanoseconds period, int core);
[[gnu::weak]] void begin_chain(runtime::Chain& chain, runtime::Chain::Source source, int pin,
                               const char* words);
class Lock;
[[gnu::weak]] void declare_use(Lock& lock);
[[gnu::weak]] void declare_section(Lock& lock, int loop, Nanoseconds length,
                                   const std::source_location& where);
namespace freertos {
struct Task;
[[gnu::weak]] Task* make_task(void (*function)(void*), const char* name, std::uint32_t stack_depth,
                              void* parameters, std::uint8_t priority);
}  // namespace freertos
[[gnu::weak]] void settle_console(int ms);
[[gnu::weak]] void hold_console(bool held);
[[gnu::weak]] const char* console_lost();
[[gnu::weak]] std::string serial_waits();
}  // namespace qduino::arduino

namespace qduino::apps {
namespace {

constexpr Fail fail{""};

/// True: the sketch's output to Serial waits (64 KB of it), so that a report can come first. False:
/// it goes on.
void hold_sketch_output(bool held) {
    if (&arduino::hold_console != nullptr) arduino::hold_console(held);
}

/// How long the end waits for somebody who does not read, and when it was asked for.
constexpr int kSettle_ms = 1000, kSettleAtOnce_ms = 250;

/// Nobody reads what stdout still has: writing it would wait for ever.
bool stdout_is_stuck() {
    pollfd look{STDOUT_FILENO, POLLOUT, 0};
    return ::poll(&look, 1, 0) == 0;
}

/// Says so when the sketch's words did not reach standard output. A reader that has gone (head, a
/// pager) lost nothing that he wanted.
bool all_was_written() {
    const char* why = &arduino::console_lost != nullptr ? arduino::console_lost() : nullptr;
    if (!why && std::ferror(stdout) != 0) why = "it could not be written";
    if (why) fail(text<std::string>("what the sketch wrote to standard output is lost: ", why));
    return why == nullptr;
}

/// How setup() is called, and whether it has ended.
struct SetupCall {
    const SketchCourse* course = nullptr;
    bool ended = true;

    void operator()(void (*setup)()) {
        if (setup && course->setup) {
            ended = course->setup(setup);
        } else if (setup) {
            setup();
        }
    }
};
SetupCall call_setup;  // a table's setup() has no argument

/// The sketch's setup(), with its loops' output held back behind it: the first report comes before
/// their first words.
void quiet_setup() {
    call_setup(runtime::sketch_table().setup);
    settle_sketch_output();
    hold_sketch_output(true);
}

int refuse(const runtime::Runtime& runtime, const Error& error, const std::string& last_words) {
    settle_sketch_output();
    fail(error);
    // Admission agreed, so the board refused.
    if (runtime.plan().admitted()) return 1;
    fail(runtime.explanation());
    say(last_words);
    return 2;
}

/// Writes the report: at the start, and again at the end, when residual interrupts have been
/// counted, and handlers timed.
bool report_to(const std::string& path, const board::GuaranteeReport& guarantee) {
    if (path.empty()) return true;
    const Result<void> written = write_guarantee(guarantee, path);
    if (!written) fail(written.error());
    return written.ok();
}

/// Reports what was measured, where that was asked for.
bool profile_to(const SketchOptions& options, const runtime::Runtime& runtime, Instant end) {
    if (!options.profiles()) return true;
    const ProfiledRun run{.sketch = options.name, .margin = options.margin_percent / 100, .end = end};
    report_beside_sketch(profile_text(runtime, run) + "\n" + lock_lengths(run.margin));
    const Result<void> written = posix::write_durably(options.profile_path, profile_json(runtime, run), 0666);
    if (!written) fail(written.error());
    return written.ok();
}

}  // namespace

CommandLine::Option add_sketch_options(CommandLine& line, SketchOptions& options, const char* length,
                                       const char* board) {
    const CommandLine::Option length_option = line.option("--for", options.length_s, length).called("S");
    line.option("--board", options.board_path, board).called("FILE");
    line.option("--report", options.report_path, "Write the guarantee report here, as JSON").called("FILE");
    line.option("--profile", options.profile_path, "Measure execution times; write them here, as JSON")
        .called("FILE");
    line.option("--margin", options.margin_percent, "Of suggested budgets, in % (default 20)")
        .called("P")
        .within(0.0, 1000.0);
    return length_option;
}

int run_sketch(board::Board& board, const SketchOptions& options, const SketchCourse& course) {
    runtime::RuntimeOptions runtime_options = course.runtime;
    runtime_options.profile = options.profiles();
    runtime::Runtime runtime(board, runtime_options);
    call_setup = {.course = &course};
    if (Result<void> begun = runtime.begin(runtime::sketch_table(), &quiet_setup); !begun)
        return refuse(runtime, begun.error(), course.refused);
    report_beside_sketch(with_outcomes(text<std::string>(runtime.plan().admission_table()) +
                                           lock_assumptions(runtime, runtime::sketch_table()),
                                       wants_colour(STDERR_FILENO)) +
                         course.opening() + '\n');
    hold_sketch_output(false);
    bool reported = report_to(options.report_path, guarantee_of(runtime));
    if (call_setup.ended) course.play(runtime);
    course.stop(runtime);
    settle_sketch_output();
    const board::GuaranteeReport guarantee = guarantee_of(runtime);
    reported = report_to(options.report_path, guarantee) && reported;
    if (const std::string handlers = handlers_kept(guarantee); !handlers.empty())
        report_beside_sketch(handlers);
    if (const std::string notes = sleep_notes(runtime) + lock_notes(runtime, runtime::sketch_table());
        !notes.empty())
        report_beside_sketch(notes);
    if (&arduino::serial_waits != nullptr) {
        if (const std::string notes = arduino::serial_waits(); !notes.empty()) report_beside_sketch(notes);
    }
    const bool written = all_was_written();
    const int status = course.report(loops_of(runtime));
    const bool profiled = profile_to(options, runtime, board.now());
    const int outcome = reported && profiled && written ? status : 1;
    if (course.leave) course.leave(outcome);
    return outcome;
}

namespace {

bool declares_sections() {
    void (*const declare)(arduino::Lock&, int, Nanoseconds, const std::source_location&) =
        &arduino::declare_section;
    return declare != nullptr;
}

}  // namespace

bool setup_may_declare() {
    return &arduino::interrupts_vcpu != nullptr || declares_sections() || &arduino::declare_use != nullptr ||
           &arduino::begin_chain != nullptr || &arduino::freertos::make_task != nullptr;
}

void settle_sketch_output() {
    if (&arduino::settle_console != nullptr)
        arduino::settle_console(stop_asked() ? kSettleAtOnce_ms : kSettle_ms);
    if (stop_asked() && stdout_is_stuck()) ::__fpurge(stdout);
    std::fflush(stdout);
}

void report_beside_sketch(const std::string& report) { say("\n" + report); }

}  // namespace qduino::apps
