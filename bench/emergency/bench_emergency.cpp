// bench-emergency: from the last byte of an M112 on the serial host's port to the last step and to
// the heater's pin, in real time.
//
//   bench-emergency [--json] [--rounds N]
//
//   this process (the machine: pins, twin)                    supervisor ─► printer: moves, heats
//      │  "M112" into the pty, at a random moment ─► printer-port ── link ────┘
//      └─ when was the last microstep, when did the heater go off? By the instants of the edges.
//
// printd is the one of ./run: in a VCPU of 10 ms in 100 ms of core 0. printer-port reads the
// pty, at the rank of the sketch's I/O VCPU. A tty's bytes go through a kernel thread
// (flush_to_ldisc, in a work queue of ordinary threads) before anybody can read them: that part
// has a row of its own, by the time at which printer-port had read them. Between two rounds the
// fault is cleared over HTTP, and the host heats and moves anew. `busy` is with two processes
// beside it that only compute. Both are measured with the stepper loop's core emptied, as root, and
// with a core that it shares with the kernel's own work: as on a computer that gives up none. The
// clock starts before the bytes are written: what writing takes counts.
#include <arpa/inet.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <random>

#include "bench/rig/child.h"
#include "bench/rig/options.h"
#include "bench/rig/processes.h"
#include "bench/rig/samples.h"
#include "board/linux/kernel/clock.h"
#include "board/linux/pin/pins_server.h"
#include "link/link_file.h"
#include "posix/unique_fd.h"
#include "twin/printer.h"

namespace qduino::bench {
namespace {

using board::linux::block_until;
using board::linux::monotonic_now;
using board::linux::PinsServer;
using posix::UniqueFd;

constexpr Nanoseconds kLook = 500us;
constexpr Nanoseconds kPatience = 8s;
/// When nothing has moved for so long, it stands.
constexpr Nanoseconds kStill = 30ms;
constexpr double kAsked_ms = 10;
constexpr const char* kOwnPart = "from that on, all";

/// The print service and its two doors.
class Service {
  public:
    Service(const std::string& folder, const std::string& link) : folder_(folder) {
        const std::string state = folder + "/state", socket = folder + "/port";
        std::filesystem::create_directories(state);
        port_process_ = start_quietly({program_beside("printer-port"), "--port", "pty", "--state", state,
                                       "--link", link, "--service", socket});
        process_ = start_quietly({program_beside("qduino"), "vcpu", "--budget", "10", "--period", "100",
                                  "--core", "0", "--", program_beside("printd"), "--state", state, "--link",
                                  link, "--listen", "127.0.0.1:0", "--print-link", "--serial-port", socket},
                                 folder + "/said");
    }
    ~Service() {
        for (const pid_t each : {process_, port_process_}) {
            ::kill(each, SIGTERM);
            ::waitpid(each, nullptr, 0);
        }
    }
    Service(const Service&) = delete;
    Service& operator=(const Service&) = delete;

    /// Opens the port and learns the address and the key. False: not there yet.
    bool open() {
        port_ = UniqueFd{::open((folder_ + "/state/serial").c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK)};
        std::ifstream said{folder_ + "/said"}, kept{folder_ + "/state/api-key"};
        for (std::string line; std::getline(said, line);) {
            const std::size_t at = line.find("http://127.0.0.1:");
            if (at != std::string::npos) http_port_ = std::atoi(line.c_str() + at + 17);
        }
        std::getline(kept, key_);
        if (port_.get() < 0 || http_port_ == 0 || key_.empty()) return false;
        termios raw{};
        ::tcgetattr(port_.get(), &raw);
        ::cfmakeraw(&raw);
        return ::tcsetattr(port_.get(), TCSANOW, &raw) == 0;
    }
    void say(std::string_view bytes) const {
        static_cast<void>(!::write(port_.get(), bytes.data(), bytes.size()));
    }
    /// Reads what the printer answers, so that it can go on.
    void hear() const {
        char bytes[4096];
        while (::read(port_.get(), bytes, sizeof bytes) > 0) {
        }
    }
    /// POST `path`; the answer is not waited for.
    void post(const std::string& path) {
        request_ = UniqueFd{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_port = htons(static_cast<std::uint16_t>(http_port_));
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        if (::connect(request_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
            return;
        const std::string request = "POST " + path +
                                    " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(http_port_) +
                                    "\r\nX-Api-Key: " + key_ + "\r\nContent-Length: 0\r\n\r\n";
        static_cast<void>(!::write(request_.get(), request.data(), request.size()));
    }

  private:
    std::string folder_;
    pid_t process_ = -1, port_process_ = -1;
    UniqueFd port_;
    UniqueFd request_;
    int http_port_ = 0;
    std::string key_;
};

struct Stopped {
    Nanoseconds read{};    ///< from the M112 until printer-port had read it: the kernel's part
    Nanoseconds motion{};  ///< from the M112 to the last microstep
    Nanoseconds heat{};    ///< … to the heater's pin
};

/// A printer, its service, and the machine that this process is.
class Stand final : twin::MotionObserver {
  public:
    Stand(PinsServer server, const std::string& pins, const std::string& folder, bool isolates)
        : server_(std::move(server)),
          folder_(folder),
          twin_(twin::Machine{}),
          service_(folder, folder + "/link") {
        twin_.observe(this);
        std::vector<std::string> command{program_beside("qduino-supervisor"),
                                         "--pins",
                                         pins,
                                         "--link",
                                         folder + "/link",
                                         "--settings-state",
                                         folder + "/settings",
                                         "--",
                                         program_beside("printer"),
                                         "--pins",
                                         pins,
                                         "--link",
                                         folder + "/link"};
        if (isolates) command.emplace_back("--isolate");
        supervisor_ = start_quietly(command, folder + "/printer-said");
    }
    ~Stand() override {
        ::kill(supervisor_, SIGTERM);
        while (::waitpid(supervisor_, nullptr, WNOHANG) == 0) pass();
    }
    Stand(const Stand&) = delete;
    Stand& operator=(const Stand&) = delete;

    [[nodiscard]] bool come_up() {
        return until([&] {
            if (!link_) {
                if (auto mapped = apps::map_link(folder_ + "/link")) link_ = std::move(*mapped);
            }
            return link_ && service_.open();
        });
    }
    /// It moves and heats. False: it does not get there.
    [[nodiscard]] bool work() {
        std::string lines = "M104 S200\nG91\n";
        for (int i = 0; i < 8; ++i) lines += "G1 X6 F6000\nG1 X-6\n";
        Instant said{};
        return until([&] {
            const Instant now = monotonic_now();
            if (moves() && heats()) return true;
            if (now - said > 150ms) {
                service_.post("/api/v1/machine/clear-fault");
                service_.say(lines);
                said = now;
            }
            return false;
        });
    }
    /// Nothing: it went on.
    [[nodiscard]] std::optional<Stopped> stop() {
        const AboveAll while_it_counts;
        pass();
        const Instant from = monotonic_now();
        service_.say("M112\n");
        if (!until([&] { return !heats() && server_.horizon() - std::max(from, last_step_) > kStill; }))
            return std::nullopt;
        const Instant cold = twin_.state(server_.horizon()).heater_off_since[twin::kHotEnd];
        const Instant read = instant_from_ns(link_.get()->port_stop_ns.load());
        return Stopped{read - from, std::max(last_step_ - from, Nanoseconds{0}),
                       std::max(cold - from, Nanoseconds{0})};
    }
    /// Why it does not work, as it says itself.
    [[nodiscard]] std::string said() const {
        const auto status = link_.get()->job_status.read();
        if (status.state != printer::link::MachineState::starting) return std::string{status.fault.view()};
        std::ifstream printed{folder_ + "/printer-said"};
        for (std::string line; std::getline(printed, line);)
            if (line.starts_with("printer: ")) return line;
        return "it has not started";
    }
    void run(Nanoseconds length) {
        for (const Instant end = monotonic_now() + length; monotonic_now() < end;) pass();
    }

  private:
    void on_step(const twin::StepSeen& step) override { last_step_ = step.at; }
    void on_endstop(Instant, int, bool) override {}

    [[nodiscard]] bool heats() { return twin_.state(server_.horizon()).heater_duty[twin::kHotEnd] > 0; }
    [[nodiscard]] bool moves() const {
        return last_step_ != Instant{} && server_.horizon() - last_step_ < kStill / 3;
    }
    void pass() {
        block_until(monotonic_now() + kLook);
        server_.poll(server_.past(), twin_);
        service_.hear();
    }
    template <typename Done>
    [[nodiscard]] bool until(Done done) {
        const Instant give_up = monotonic_now() + kPatience;
        while (!done()) {
            if (monotonic_now() > give_up || interrupted()) return false;
            pass();
        }
        return true;
    }

    PinsServer server_;
    std::string folder_;
    apps::LinkFile link_;
    twin::Printer twin_;
    Service service_;
    pid_t supervisor_ = -1;
    Instant last_step_{};
};

/// What surrounds a series of stops.
struct Setting {
    bool isolates;
    bool busy;
    [[nodiscard]] const char* core() const { return isolates ? "isolated" : "shared"; }
    [[nodiscard]] const char* load() const { return busy ? "busy" : "idle"; }
};

Json row(const Setting& setting, const char* until, std::vector<std::int64_t> times) {
    std::sort(times.begin(), times.end());
    return {{"core", setting.core()},
            {"load", setting.load()},
            {"until", until},
            {"ms_p50", static_cast<double>(percentile(times, 0.5)) / 1e6},
            {"ms_p90", static_cast<double>(percentile(times, 0.9)) / 1e6},
            {"ms_max", times.empty() ? 0.0 : static_cast<double>(times.back()) / 1e6},
            {"stops", times.size()}};
}

/// Nothing, or why there are fewer rounds.
std::string play_on(const std::string& folder, int rounds, const Setting& setting, Report& report) {
    const std::string pins = folder + "/pins";
    auto server = PinsServer::create(pins);
    if (!server) return std::string{server.error().message.view()};
    Stand stand{std::move(*server), pins, folder, setting.isolates};
    if (!stand.come_up()) return "the print service did not come up";
    const Busy busy{setting.busy ? 2 : 0};
    std::mt19937_64 random{std::random_device{}()};
    std::vector<std::int64_t> read, motion, heat, own;
    std::string why;
    for (int round = 0; round < rounds && why.empty(); ++round) {
        if (!stand.work()) {
            why = "the printer did not move and heat: " + stand.said();
            break;
        }
        stand.run(Nanoseconds{static_cast<std::int64_t>(random() % 100'000'000)});
        const auto stopped = stand.stop();
        if (!stopped) {
            why = "it went on after an M112";
            break;
        }
        read.push_back(to_ns(stopped->read));
        motion.push_back(to_ns(stopped->motion));
        heat.push_back(to_ns(stopped->heat));
        own.push_back(to_ns(std::max(stopped->heat, stopped->motion) - stopped->read));
    }
    report.results.push_back(row(setting, "the kernel has handed it over", read));
    report.results.push_back(row(setting, "last microstep", motion));
    report.results.push_back(row(setting, "heater off", heat));
    report.results.push_back(row(setting, kOwnPart, own));
    return why;
}

void judge(const char* core, Report& report) {
    double worst = 0, own = 0;
    for (const Json& each : report.results) {
        if (each["core"] != core) continue;
        double& longest = each["until"] == kOwnPart ? own : worst;
        longest = std::max(longest, each["ms_max"].get<double>());
    }
    const bool all = report.failures.empty();
    report.remarks.push_back(verdict(worst <= kAsked_ms && all,
                                     "%s core: all stands and is off %.2f ms after an M112; at most %.0f",
                                     core, worst, kAsked_ms));
    report.remarks.push_back(
        verdict(own <= kAsked_ms && all, "… %.2f ms after the kernel has handed it over", own));
}

int run(const Options& options) {
    Report report;
    report.guarantee =
        "printer's three loops at real-time priority; the stepper loop's core isolated (as root) or shared; "
        "printd in its VCPU";
    for (const bool isolates : {true, false}) {
        for (const bool busy : {false, true}) {
            const Setting setting{isolates, busy};
            std::string folder = "/dev/shm/qduino-bench-emergency-XXXXXX";
            if (::mkdtemp(folder.data()) == nullptr) return 1;
            const std::string why = play_on(folder, options.rounds, setting, report);
            if (!why.empty()) report.add_failure(std::string{setting.core()} + " " + setting.load(), why);
            std::filesystem::remove_all(folder);
        }
        judge(Setting{isolates, false}.core(), report);
    }
    print(report, options.json);
    return 0;
}

}  // namespace
}  // namespace qduino::bench

int main(int argc, char** argv) {
    using namespace qduino::bench;
    return run_benchmark(argc, argv, {.rounds = 50},
                         {.description = "From an M112 on the serial port until nothing moves or heats.",
                          .footer = "Example: bench-emergency --json > emergency.json"},
                         run);
}
