// bench-safety: how long the heaters stay on after a death, as the machine sees its pins.
//
//   bench-safety [--json] [--rounds N]
//
//   this process (the machine: pins, twin, real-time)     supervisor ─► printer, both heaters on
//      │  kill -9 of the sketch, or of the supervisor, at a random moment
//      └─ polls its pins every 0.5 ms until both heaters' duties are 0 ─► the figure
//
// For comparison, the same run also measures when the killed sketch is gone (its pidfd readable): a
// supervisor that waits for its child sees only that. `busy` is with two processes beside it that
// only compute.
#include <poll.h>
#include <signal.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <random>

#include "bench/rig/child.h"
#include "bench/rig/options.h"
#include "bench/rig/processes.h"
#include "bench/rig/samples.h"
#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/real_time_thread.h"
#include "board/linux/pin/pins_server.h"
#include "link/link_file.h"
#include "posix/unique_fd.h"
#include "printer/link/frame.h"
#include "twin/printer.h"

namespace qduino::bench {
namespace {

using board::linux::block_until;
using board::linux::monotonic_now;
using board::linux::PinsServer;
using posix::UniqueFd;

constexpr Nanoseconds kLook = 500us;
constexpr Nanoseconds kPatience = 5s;
struct Killed {
    Nanoseconds heat_off{};     ///< from the kill to both duties 0
    Nanoseconds sketch_gone{};  ///< … to the sketch's pidfd
};

/// One printer with both heaters on, and its machine.
class HotPrinter {
  public:
    explicit HotPrinter(PinsServer server, const std::string& pins)
        : server_(std::move(server)), twin_(twin::Machine{}), link_path_(pins + ".link") {
        supervisor_ =
            start_quietly({program_beside("qduino-supervisor"), "--pins", pins, "--link", link_path_, "--",
                           program_beside("printer"), "--pins", pins, "--link", link_path_});
    }
    ~HotPrinter() {
        ::kill(supervisor_, SIGTERM);
        while (::waitpid(supervisor_, nullptr, WNOHANG) == 0) pass(1ms);
        // The heat watch of a killed supervisor may still be at work on the files.
        const Instant end = monotonic_now() + 300ms;
        while (monotonic_now() < end) pass(1ms);
        std::filesystem::remove(link_path_);
    }
    HotPrinter(const HotPrinter&) = delete;
    HotPrinter& operator=(const HotPrinter&) = delete;

    /// False: they do not reach their targets.
    bool heat_up() {
        const Instant give_up = monotonic_now() + 2 * kPatience;
        apps::LinkFile link;
        while (!both_on()) {
            pass(1ms);
            if (monotonic_now() > give_up) return false;
            if (link) continue;
            if (auto opened = apps::open_link(link_path_)) {
                link = std::move(*opened);
                for (const char* line : {"M104 S210", "M140 S60"}) {
                    using namespace printer::link;
                    if (!try_push(link.get()->commands, encode(CommandText{Command::gcode, line})))
                        return false;
                }
            }
        }
        return true;
    }
    void run(Nanoseconds length) {
        const Instant end = monotonic_now() + length;
        while (monotonic_now() < end) pass(kLook);
    }
    /// Empty: the heaters were not off after kPatience.
    std::optional<Killed> kill(bool the_supervisor) {
        const auto sketch = static_cast<pid_t>(server_.layout().sketch_pid.load());
        const UniqueFd process{static_cast<int>(::syscall(SYS_pidfd_open, sketch, 0))};
        const AboveAll while_it_counts;
        block_until(monotonic_now() + 20ms);
        Killed killed;
        const Instant from = monotonic_now();
        ::kill(the_supervisor ? supervisor_ : sketch, SIGKILL);
        for (;;) {
            pass(kLook);
            const Nanoseconds since = monotonic_now() - from;
            pollfd gone{process.get(), POLLIN, 0};
            if (killed.sketch_gone == Nanoseconds{0} && ::poll(&gone, 1, 0) > 0) killed.sketch_gone = since;
            if (killed.heat_off == Nanoseconds{0} && both_off()) killed.heat_off = since;
            if (killed.sketch_gone != Nanoseconds{0} && killed.heat_off != Nanoseconds{0}) return killed;
            if (since > kPatience) return std::nullopt;
        }
    }

  private:
    void pass(Nanoseconds limit) {
        block_until(monotonic_now() + limit);
        server_.poll(server_.past(), twin_);
    }
    bool both_on() {
        const auto duty = twin_.state(server_.horizon()).heater_duty;
        return duty[twin::kHotEnd] > 0 && duty[twin::kBed] > 0;
    }
    bool both_off() {
        const auto duty = twin_.state(server_.horizon()).heater_duty;
        return duty[twin::kHotEnd] == 0 && duty[twin::kBed] == 0;
    }

    PinsServer server_;
    twin::Printer twin_;
    std::string link_path_;
    pid_t supervisor_ = -1;
};

std::optional<Killed> kill_once(bool the_supervisor, Nanoseconds moment, std::string& failure) {
    const std::string pins = "/dev/shm/qduino-bench-safety-" + std::to_string(::getpid());
    auto server = PinsServer::create(pins);
    if (!server) {
        failure = server.error().message.view();
        return std::nullopt;
    }
    std::optional<Killed> killed;
    {
        HotPrinter printer{std::move(*server), pins};
        if (!printer.heat_up()) {
            failure = "the heaters did not come on";
        } else {
            printer.run(moment);
            killed = printer.kill(the_supervisor);
            if (!killed) failure = "the heaters were on 5 s after the kill";
        }
    }
    std::filesystem::remove(pins);
    return killed;
}

Json row(const std::string& killed, const std::string& load, const char* until,
         std::vector<std::int64_t> times) {
    std::sort(times.begin(), times.end());
    return {{"killed", killed},
            {"load", load},
            {"until", until},
            {"ms_p50", static_cast<double>(percentile(times, 0.5)) / 1e6},
            {"ms_p90", static_cast<double>(percentile(times, 0.9)) / 1e6},
            {"ms_max", times.empty() ? 0.0 : static_cast<double>(times.back()) / 1e6},
            {"kills", times.size()}};
}

void play(int rounds, const std::string& who, const std::string& load, Report& report) {
    const Busy busy{load == "busy" ? 2 : 0};
    std::mt19937_64 random{std::random_device{}()};
    std::vector<std::int64_t> off, gone;
    for (int round = 0; round < rounds && !interrupted(); ++round) {
        std::fprintf(stderr, "%s, %s: %d of %d …\n", who.c_str(), load.c_str(), round + 1, rounds);
        std::string failure;
        const auto killed = kill_once(
            who == "supervisor", Nanoseconds{static_cast<std::int64_t>(random() % 300'000'000)}, failure);
        if (!killed) {
            report.add_failure(who, failure);
            continue;
        }
        off.push_back(to_ns(killed->heat_off));
        gone.push_back(to_ns(killed->sketch_gone));
    }
    report.results.push_back(row(who, load, "heaters off", off));
    report.results.push_back(row(who, load, "sketch gone", gone));
}

int run(const Options& options) {
    Report report;
    report.guarantee = "printer's three loops and supervisor at real-time priority; cores not isolated";
    for (const char* who : {"sketch", "supervisor"}) {
        for (const char* load : {"idle", "busy"}) play(options.rounds, who, load, report);
    }
    double worst = 0;
    for (const Json& each : report.results) {
        if (each["until"] == "heaters off") worst = std::max(worst, each["ms_max"].get<double>());
    }
    report.remarks.push_back(verdict(worst <= 100 && report.failures.empty(),
                                     "the heaters are off %.1f ms after a kill; at most 100", worst));
    print(report, options.json);
    return 0;
}

}  // namespace
}  // namespace qduino::bench

int main(int argc, char** argv) {
    using namespace qduino::bench;
    return run_benchmark(
        argc, argv, {.rounds = 20},
        {.description = "How long the heaters stay on after a kill -9, as the machine sees its pins.",
         .footer = "Example: bench-safety --json > safety.json"},
        run);
}
