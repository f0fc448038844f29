#include "apps/printer_sim/print_file.h"

#include <fcntl.h>
#include <sys/mman.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <new>

#include "apps/printer_sim/sim_printer.h"
#include "apps/printer_sim/step_log.h"
#include "posix/file_bytes.h"
#include "posix/small_file.h"
#include "printer/estimate/estimator.h"
#include "printer/gcode/content.h"
#include "printer/link/frame.h"
#include "printer/preflight/preflight.h"
#include "printer/preflight/prologue.h"
#include "report/chain_report.h"
#include "spool/feeder.h"
#include "twin/job.h"

namespace qduino::apps {
namespace {

namespace link = printer::link;

constexpr Nanoseconds kSlice = 50ms;
// Virtual time. A job's longest wait is a heat-up.
constexpr Nanoseconds kStallLimit = 30min;

/// Collects the sketch's words during the print: answers; unknown codes and warnings, each once.
class ReplyReader {
  public:
    void read(link::LinkLayout& from, PrintResult& into) {
        while (true) {
            const auto frame = reader_.read(from.replies);
            if (!frame.ok() || !frame->has_value()) return;
            const auto reply = link::decode_reply((*frame)->payload);
            if (!reply.ok()) continue;
            const std::string text(reply->text);
            if (reply->kind == link::ReplyKind::text) {
                if (into.answers.size() < kKept) into.answers.push_back(text);
                continue;
            }
            const bool unknown = text.find("Unknown command") != std::string::npos;
            auto& list = unknown ? into.unknown_codes : into.warnings;
            if (list.size() < kKept && std::find(list.begin(), list.end(), text) == list.end())
                list.push_back(text);
        }
    }

  private:
    static constexpr std::size_t kKept = 100;
    link::FrameReader reader_;
};

/// A feeder of the file at `path` as job `id` of the link, if that is G-code.
Result<spool::Feeder> open_job(const std::string& path, std::uint64_t id,
                               const printer::MachineConfig& machine) {
    posix::UniqueFd file{::open(path.c_str(), O_RDONLY | O_CLOEXEC)};
    std::array<char, 4096> head;
    const Result<std::size_t> count = posix::read_some(file.get(), head, path);
    if (!count) return make_error(ErrorCode::not_found, path, ": cannot be read; check the path");
    const auto content = printer::gcode::look_at_content(std::span{head}.first(*count), machine);
    if (content != printer::gcode::Content::gcode)
        return make_error(ErrorCode::unsupported, path, ": ", printer::gcode::explain(content));
    return spool::Feeder{std::make_shared<posix::FileBytes>(std::move(file)), id};
}

/// What the print service asks before it takes a job: does it fit this machine? Returns the lines
/// that home and heat first, if those are all that is missing.
std::string check(const PrintOptions& options, PrintResult& result) {
    // On the heap: findings and parser state are too large for a stack to be taken for granted.
    const auto preflight = std::make_unique<printer::preflight::Preflight>(options.machine);
    const auto estimator = std::make_unique<printer::estimate::Estimator>(options.machine);
    preflight->add_sink(*estimator);
    twin::FileSource file{options.file};
    std::array<char, 16 * 1024> bytes;
    while (const std::size_t count = file.read(bytes)) preflight->feed(std::span{bytes}.first(count));
    const printer::preflight::Facts& facts = preflight->finish();
    result.estimate = estimator->estimate();
    for (const auto& found : facts.warnings)
        result.remarks.push_back(text<std::string>(
            found.line > 0 ? text<std::string>("line ", found.line, ": ") : "", found.message));
    if (facts.accepted()) return {};
    const printer::preflight::Finding& first = facts.first_error();
    result.refusal = Refusal{first.line, std::string{first.text.view()}, std::string{first.message.view()},
                             std::string{first.advice.view()}};
    if (!facts.lacks_start()) return {};
    result.refusal->cure = "Home and heat first: printer-sim --prologue. Or: " + result.refusal->cure;
    return printer::preflight::prologue_of(options.machine, facts);
}

/// The same job behind `lines`, as a file in memory, whose path is options.file from then on.
Result<posix::UniqueFd> put_before(const std::string& lines, PrintOptions& options) {
    posix::UniqueFd whole{::memfd_create("job", MFD_CLOEXEC)};
    QDUINO_TRY(posix::write_all(whole.get(), lines, "the job"));
    twin::FileSource file{options.file};
    std::array<char, 16 * 1024> bytes;
    while (const std::size_t count = file.read(bytes))
        QDUINO_TRY(posix::write_all(whole.get(), std::span{bytes}.first(count), "the job"));
    options.file = text<std::string>("/proc/self/fd/", whole.get());
    return whole;
}

/// A job that pauses by itself (M0, M600) waits for a person: this is the one. Asked twice before
/// the machine looks, it goes on once.
void resume(link::LinkLayout& to, const link::JobStatus& status, PrintResult& result) {
    if (status.state != link::MachineState::paused) return;
    const link::CommandText command{link::Command::resume, {}};
    static_cast<void>(link::try_push(to.commands, link::encode(command)));
    // Before its first move has ended a job is at no line.
    const auto told = text<std::string>(status.line > 0 ? text<std::string>("line ", status.line, ": ") : "",
                                        "the job paused, and was resumed");
    if (result.remarks.empty() || result.remarks.back() != told) result.remarks.push_back(told);
}

BoardCosts costs_of(const PrintOptions& options, SimPrinter& printer) {
    std::uint64_t steps = 0;
    for (const twin::AxisCounters& axis : printer.twin().state(printer.now()).counters)
        steps += axis.moved + axis.lost();
    return board_costs(options.board_name, options.computer, printer.board(),
                       to_seconds(printer.now().time_since_epoch()), steps);
}

/// Runs job `id` until it has an outcome.
void run_job(SimPrinter& printer, spool::Feeder& feeder, std::uint64_t id, const PrintOptions& options,
             PrintResult& result) {
    ReplyReader replies;
    const Instant began = printer.now();
    std::uint64_t executed = 0;
    Instant moved = began;
    link::JobStatus status;
    for (int slice = 0;; ++slice) {
        const Result<void> fed = feeder.feed_alone(printer.link(), printer.now());
        const bool running = printer.run(printer.now() + kSlice);
        replies.read(printer.link(), result);
        status = printer.link().job_status.read();
        const bool over = status.job_id == id && status.outcome != link::JobOutcome::running;
        if (over || status.state == link::MachineState::faulted) break;
        resume(printer.link(), status, result);
        if (status.bytes_executed != executed) moved = printer.now();
        executed = status.bytes_executed;
        if (!running || !fed || printer.now() - moved > kStallLimit) {
            status.fault.assign(!fed      ? fed.error().message
                                : running ? "nothing has moved for 30 minutes"
                                          : "the sketch stopped");
            break;
        }
        if (options.progress && slice % 20 == 0) {
            options.progress(static_cast<double>(executed) /
                                 static_cast<double>(std::max<std::uint64_t>(1, status.job_length)),
                             to_seconds(printer.now() - began));
        }
    }
    result.print_time_s = to_seconds(printer.now() - began);
    result.job_completed = status.outcome == link::JobOutcome::completed;
    if (!result.job_completed) result.error = status.fault.view();
}

/// Prints the jobs that come first. Returns where the last of them leaves the twin's watch; nothing
/// where there is none. Error: one of them did not end well.
Result<std::optional<twin::InspectionStart>> print_before(SimPrinter& printer, const PrintOptions& options) {
    std::optional<twin::InspectionStart> place;
    std::uint64_t id = 0;
    for (const std::string& file : options.before) {
        QDUINO_TRY_ASSIGN(spool::Feeder feeder, open_job(file, ++id, options.machine));
        twin::Job job(printer.twin(), std::make_unique<twin::FileSource>(file), printer.now(), place);
        PrintResult result;
        run_job(printer, feeder, id, options, result);
        if (!result.job_completed) return make_error(ErrorCode::unavailable, file, ": ", result.error);
        printer.run(printer.now() + 500ms);
        static_cast<void>(job.finish(printer.now(), true, printer.link().job_status.read().excursions));
        place = job.next_start();
    }
    return place;
}

}  // namespace

Result<PrintResult> print_file(const PrintOptions& asked) {
    PrintOptions options = asked;
    const auto wall_start = std::chrono::steady_clock::now();
    const std::uint64_t id = options.before.size() + 1;
    QDUINO_TRY_ASSIGN(spool::Feeder feeder, open_job(options.file, id, options.machine));
    PrintResult result;
    const std::string lines = check(options, result);
    posix::UniqueFd whole;
    if (options.prologue && !lines.empty()) {
        QDUINO_TRY_ASSIGN(whole, put_before(lines, options));
        QDUINO_TRY_ASSIGN(feeder, open_job(options.file, id, options.machine));
        result = {};
        static_cast<void>(check(options, result));
        result.remarks.push_back("the job was homed and heated first (--prologue)");
    }
    if (result.refusal) return result;
    const std::unique_ptr<link::LinkLayout> memory{new (std::nothrow) link::LinkLayout{}};
    if (!memory) return make_error(ErrorCode::unavailable, "not enough memory for the link (12 MB)");

    std::unique_ptr<StepLog> steps;  // before the printer, whose board writes to it until the end
    SimPrinter printer(options.machine, options.metal, *memory);
    if (!options.steps_path.empty()) {
        steps = std::make_unique<StepLog>(options.steps_path, options.machine, printer.twin());
        if (!steps->ok())
            return make_error(ErrorCode::not_permitted, options.steps_path, ": cannot be written");
    }
    for (const twin::Fault& fault : options.faults) printer.twin().inject(fault);
    QDUINO_TRY(printer.begin(steps.get(), options.computer));
    printer.run(instant_from_ns(0) + 1s);  // the sketch says that it is idle
    QDUINO_TRY_ASSIGN(const std::optional<twin::InspectionStart> place, print_before(printer, options));
    if (steps) steps->begin();

    std::optional<twin::PrintRecord> record;
    twin::Job job(printer.twin(), std::make_unique<twin::FileSource>(options.file), printer.now(), place);
    if (options.heights) job.fill_in(&record.emplace(options.metal, printer.now(), options.cells));
    run_job(printer, feeder, id, options, result);
    printer.run(printer.now() + 500ms);
    result.motion = memory->motion_status.read();
    result.kept = memory->kept_heat.read();
    result.kept_beds = memory->kept_beds.read();
    if (record) result.observed = observed(*record, printer.now(), options.file);
    if (!options.board_name.empty()) result.board = costs_of(options, printer);
    result.chains = chain_lines(printer.runtime());
    result.built = job.finish(printer.now(), true, memory->job_status.read().excursions);
    if (steps && !steps->close())
        return make_error(ErrorCode::unavailable, options.steps_path, ": disk full?");
    result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_start).count();
    return result;
}

}  // namespace qduino::apps
