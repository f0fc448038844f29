#include "apps/launcher/launcher.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <fstream>

#include "apps/launcher/run_lock.h"
#include "apps/terminal/wrap.h"
#include "board/linux/clock.h"
#include "board/linux/machine_settings.h"
#include "posix/system_error.h"
#include "posix/unique_fd.h"

namespace qduino::launcher {
namespace {

namespace fs = std::filesystem;
using board::linux::monotonic_now;

constexpr std::string_view kProgramName = "printer-launcher";
constexpr int kLookEveryMs = 20;
/// The processes of an earlier printer must end within this time; those that have not are named.
constexpr Nanoseconds kPatience = 12s;
/// The supervisor gives a sketch 5 s to stop, and then kills it.
constexpr Nanoseconds kStopGrace = 8s;
/// A program that has not come up by then never will.
constexpr Nanoseconds kComeUpIn = 60s;

/// Changes when a file is made anew under the same name.
ino_t inode_of(const fs::path& path) {
    struct stat found {};
    return ::stat(path.c_str(), &found) == 0 ? found.st_ino : 0;
}

/// The error in words for a person.
Error already_running(const fs::path& state, const Error& held) {
    std::ifstream file{state / "address"};
    std::string address;
    std::getline(file, address);
    Error error{ErrorCode::already_exists, "a printer is already running with "};
    error.message.append(state.native());
    if (!address.empty()) error.message.append("\n  Open   ").append(address);
    error.message.append("\nStop it (Ctrl-C where it runs), or give another --state and --port.\n(")
        .append(held.message.view())
        .append(")");
    return error;
}

/// Takes the lock on the state folder. Waits for the processes of a killed launcher, which are
/// ending.
Result<posix::UniqueFd> take_state(const fs::path& state) {
    const fs::path file = state / "run.lock";
    auto lock = lock_file(file, Nanoseconds{0});
    if (lock || lock.error().code != ErrorCode::already_exists) return lock;
    for (const Holder& holder : holders_of(file)) {
        if (kProgramName.starts_with(holder.name)) return already_running(state, lock.error());
    }
    std::fprintf(stderr, "run: waiting for the processes of an earlier run to end: %s\n",
                 names_of(holders_of(file)).c_str());
    lock = lock_file(file, kPatience);
    if (lock || lock.error().code != ErrorCode::already_exists) return lock;
    return already_running(state, lock.error());
}

/// "interrupts 9, task groups 2, …": the lines of a settings state file
/// (board/linux/machine_settings.h), by kind.
std::string changes_in(const std::string& state_file) {
    constexpr std::array<std::pair<std::string_view, const char*>, 7> kKinds{{
        {"group\t", "task groups"},
        {"write\t/proc/irq/", "interrupts"},
        {"affinity\t", "cores of threads"},
        {"policy\t", "priorities of kernel threads"},
        {"write\t/sys/class/net/", "network queues"},
        {"write\t/sys/", "kernel settings in /sys"},
        {"write\t/proc/", "kernel settings in /proc"},
    }};
    std::array<int, kKinds.size()> counts{};
    std::ifstream file{state_file};
    for (std::string line; std::getline(file, line);) {
        const auto kind = std::find_if(kKinds.begin(), kKinds.end(),
                                       [&](const auto& each) { return line.starts_with(each.first); });
        if (kind != kKinds.end()) ++counts[static_cast<std::size_t>(kind - kKinds.begin())];
    }
    std::string text;
    for (std::size_t i = 0; i < counts.size(); ++i) {
        if (counts[i] > 0)
            text +=
                (text.empty() ? "" : ", ") + std::string{kKinds[i].second} + " " + std::to_string(counts[i]);
    }
    return text;
}

/// True once `file` is there and another one than at the last start.
std::function<bool(const std::string&)> made_anew(fs::path file) {
    return [file = std::move(file), before = ino_t{0}](const std::string&) mutable {
        const ino_t now = inode_of(file);
        return now != 0 && now != std::exchange(before, now);
    };
}

}  // namespace

Result<std::unique_ptr<Launcher>> Launcher::open(Options options) {
    std::unique_ptr<Launcher> made(new Launcher(std::move(options)));
    const Options& o = made->options_;
    std::error_code error;
    fs::create_directories(o.state, error);
    if (error)
        return make_error(ErrorCode::unavailable, "cannot make " + o.state.string() + ": " + error.message());
    auto lock = take_state(o.state);
    if (!lock) return lock.error();
    made->state_lock_ = std::move(*lock);
    fs::remove(o.state / "address", error);
    if (const int swept = MemoryFolder::sweep(MemoryFolder::kParent); swept > 0)
        std::fprintf(stderr, "run: removed what %d killed run%s had left in memory\n", swept,
                     swept > 1 ? "s" : "");
    auto memory = MemoryFolder::make(MemoryFolder::kParent, o.service_user);
    if (!memory) return memory.error();
    made->memory_ = std::move(*memory);
    if (o.speed > 0) {
        made->plan_simulator();
    } else {
        made->plan_machine();
        made->plan_sketch();
    }
    made->plan_service();
    return made;
}

void Launcher::plan_machine() {
    const fs::path pins = memory_.file("pins");
    ProcessPlan plan;
    plan.name = "virtual machine";
    plan.command = {options_.programs / "virtual-machine",
                    "--pins",
                    pins,
                    "--inspect",
                    memory_.file("inspect"),
                    "--stay-while-locked",
                    memory_.file("sketch.lock")};
    if (!options_.machine.empty()) plan.command.insert(plan.command.end(), {"--machine", options_.machine});
    plan.ready = made_anew(pins);
    plan.after_end = [this] { processes_[1]->start_anew(); };
    processes_.push_back(std::make_unique<KeptProcess>(std::move(plan)));
}

void Launcher::plan_sketch() {
    const fs::path link = memory_.file("link");
    ProcessPlan plan;
    plan.name = "sketch";
    plan.command = {options_.programs / "qduino-supervisor",
                    "--pins",
                    memory_.file("pins"),
                    "--link",
                    link,
                    "--settings-state",
                    options_.settings_state,
                    "--",
                    options_.programs / "printer",
                    "--pins",
                    memory_.file("pins"),
                    "--link",
                    link};
    if (options_.isolate) plan.command.emplace_back("--isolate");
    if (!options_.machine.empty()) plan.command.insert(plan.command.end(), {"--machine", options_.machine});
    plan.locks = memory_.file("sketch.lock");
    plan.may_start = [this] { return processes_[0]->state() == KeptProcess::State::ready; };
    plan.ready = made_anew(link);
    plan.after_end = [this] { put_settings_back(); };
    processes_.push_back(std::make_unique<KeptProcess>(std::move(plan)));
}

void Launcher::plan_simulator() {
    const fs::path link = memory_.file("link");
    ProcessPlan plan;
    plan.name = "simulated printer";
    char speed[32];
    std::snprintf(speed, sizeof speed, "%g", options_.speed);
    plan.command = {options_.programs / "printer-sim", "--link",  link, "--inspect",
                    memory_.file("inspect"),           "--speed", speed};
    if (!options_.machine.empty()) plan.command.insert(plan.command.end(), {"--machine", options_.machine});
    plan.ready = made_anew(link);
    processes_.push_back(std::make_unique<KeptProcess>(std::move(plan)));
}

void Launcher::plan_service() {
    ProcessPlan plan;
    plan.name = "print service";
    plan.command = {options_.programs / "printd",
                    "--state",
                    options_.state,
                    "--link",
                    memory_.file("link"),
                    "--inspect",
                    memory_.file("inspect"),
                    "--listen",
                    "127.0.0.1:" + std::to_string(options_.port),
                    "--ui",
                    options_.ui,
                    "--print-link"};
    if (!options_.machine.empty()) plan.command.insert(plan.command.end(), {"--machine", options_.machine});
    if (!options_.service_user.empty())
        plan.command.insert(plan.command.end(), {"--run-as", options_.service_user});
    if (!options_.confirm_bed) plan.command.emplace_back("--no-confirm-bed");
    plan.read_line = true;
    // printd's own word. An answer on the port could be another program's.
    plan.ready = [](const std::string& line) { return line.ends_with('\n'); };
    processes_.push_back(std::make_unique<KeptProcess>(std::move(plan)));
}

/// Undoes what a killed sketch had changed on this computer. Its supervisor does so, too, unless it
/// was killed with it.
void Launcher::put_settings_back() const {
    const auto restored = board::linux::restore_settings(options_.settings_state);
    if (restored && *restored == board::linux::Restored::undone)
        std::fprintf(stderr, "run: this machine's settings are as they were before\n");
}

void Launcher::say_failed(const KeptProcess& process) const {
    const Ended& ended = process.ended();
    std::fprintf(
        stderr,
        "run: the %s ended with status %d and will not come up: its message stands above. Stopping.\n",
        process.name().c_str(), ended.status);
}

const KeptProcess* Launcher::advance_all(std::size_t started) {
    const Instant now = monotonic_now();
    for (std::size_t i = 0; i < started; ++i) {
        processes_[i]->advance(now);
        if (processes_[i]->state() == KeptProcess::State::given_up) return processes_[i].get();
    }
    return nullptr;
}

/// Starts the processes in order, each when the one before is ready.
bool Launcher::come_up(int signals) {
    for (std::size_t i = 0; i < processes_.size(); ++i) {
        const Instant until = monotonic_now() + kComeUpIn;
        do {
            if (const KeptProcess* failed = advance_all(i + 1)) {
                say_failed(*failed);
                return false;
            }
            if (monotonic_now() > until) {
                std::fprintf(stderr, "run: the %s has not come up within a minute. Stopping.\n",
                             processes_[i]->name().c_str());
                return false;
            }
            pollfd stop{signals, POLLIN, 0};
            if (::poll(&stop, 1, kLookEveryMs) > 0) return false;
        } while (processes_[i]->state() != KeptProcess::State::ready);
    }
    return true;
}

void Launcher::say_changes() const {
    if (!options_.isolate) return;
    const std::string changes = changes_in(options_.settings_state);
    const std::string text = changes.empty() ? "Nothing could be changed: the guarantee report says why."
                                             : "Changed until the printer ends: " + changes +
                                                   " (each one in " + options_.settings_state + ").";
    std::fprintf(stderr, "%s", apps::wrapped(text, "").c_str());
}

void Launcher::say_open() {
    std::string address = processes_.back()->first_line();
    address.resize(address.find_last_not_of("\n") + 1);
    const fs::path file = options_.state / "address";
    const mode_t before = ::umask(077);
    std::ofstream{file} << address << '\n';
    ::umask(before);
    std::printf(
        "\n  Open  %s\n\n"
        "  Upload from a shell:\n"
        "    curl -H \"X-Api-Key: $(cat %s/api-key)\" \\\n"
        "      -F file=@part.gcode -F print=true http://127.0.0.1:%d/api/v1/jobs\n\n"
        "  Ctrl-C stops everything.\n\n",
        address.c_str(), options_.state.c_str(), options_.port);
    std::fflush(stdout);
}

/// True when it was asked to stop; false when a process has failed for good.
bool Launcher::keep(int signals) {
    for (;;) {
        if (const KeptProcess* failed = advance_all(processes_.size())) {
            say_failed(*failed);
            return false;
        }
        pollfd stop{signals, POLLIN, 0};
        if (::poll(&stop, 1, kLookEveryMs) > 0) return true;
    }
}

/// Stops in reverse order: the service, then the sketch, which drives its pins to their safe
/// states, then the machine.
void Launcher::stop_all() {
    for (auto at = processes_.rbegin(); at != processes_.rend(); ++at) (*at)->end(kStopGrace);
    std::error_code ignored;
    fs::remove(options_.state / "address", ignored);
}

int Launcher::run(int signals) {
    if (options_.isolate) {
        std::fprintf(stderr,
                     "The stepper loop gets a core of its own: other programs, interrupts and kernel work "
                     "move off it\n"
                     "while the printer runs. All of it is put back at the end, also after a crash.\n"
                     "(--no-isolate leaves this machine as it is; steps are then late more often.)\n");
    }
    const bool up = come_up(signals);
    if (up) {
        say_changes();
        say_open();
    }
    pollfd stop{signals, POLLIN, 0};
    const bool asked = up ? keep(signals) : ::poll(&stop, 1, 0) > 0;
    stop_all();
    return asked ? 0 : 1;
}

}  // namespace qduino::launcher
