#include "apps/launcher/launcher.h"

#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <span>

#include "apps/launcher/first_screen.h"
#include "apps/launcher/needed_rights.h"
#include "apps/launcher/network_words.h"
#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/host_settings.h"
#include "board/linux/kernel/kernel_text.h"
#include "config/machine_file.h"
#include "link/link_file.h"
#include "posix/guarded_file.h"
#include "posix/small_file.h"
#include "posix/system_error.h"
#include "rights/rights.h"
#include "rights/state_folder.h"
#include "terminal/human.h"
#include "terminal/message.h"
#include "web/http/forwarded.h"

namespace qduino::launcher {
namespace {

namespace fs = std::filesystem;
using board::linux::monotonic_now;

/// Before there is a log.
void say_first(const std::string& words) { apps::say(words, "run: "); }

constexpr std::string_view kProgramName = "printer-launcher";
constexpr std::size_t kAddressBytesMax = 4096;
constexpr std::size_t kSettingsBytesMax = 16 << 20;
/// A file of M500 has a bed's heights as text: 1 MiB is many.
constexpr std::size_t kKeptBytesMax = 1 << 20;
constexpr std::string_view kPty = "pty";            // a serial port
constexpr const char* kServicesFolder = "service";  // in the folder in memory
constexpr int kLookEveryMs = 20;
/// The processes of an earlier printer must end within this time; those that have not are named.
constexpr Nanoseconds kPatience = 12s;
/// The supervisor gives a sketch 5 s to stop, and then kills it.
constexpr Nanoseconds kStopGrace = 8s;
constexpr Nanoseconds kLookAtFilesEvery = 2s;
/// A program that has not come up by then never will.
constexpr Nanoseconds kComeUpIn = 60s;

/// Changes when a file is made anew under the same name.
ino_t inode_of(const fs::path& path) {
    struct stat found {};
    return ::stat(path.c_str(), &found) == 0 ? found.st_ino : 0;
}

/// The error in words for a person.
Error already_running(const fs::path& state, const std::string& holders, const ServiceUser& service) {
    const posix::ActingAs him{service.user, service.group};
    const auto read = posix::read_guarded(state / "address", kAddressBytesMax, service.user);
    const std::string address = read ? read->substr(0, read->find('\n')) : "";
    return make_error(ErrorCode::already_exists, "a printer is already running with ", state.native(),
                      address.empty() ? "" : "\n  Open   ", address,
                      "\nStop it (Ctrl-C where it runs), or give another --state and --port.\n(held by ",
                      holders, ")");
}

/// The lock, by the rights of the service's user.
Result<posix::UniqueFd> lock_as(const ServiceUser& service, const fs::path& file, Nanoseconds patience) {
    const posix::ActingAs him{service.user, service.group};
    return board::linux::lock_file(file, patience);
}

/// Takes the lock on the state folder. Waits for the processes of a killed launcher, which are
/// ending. With all rights of root: without them another user's process does not show what it has
/// open (proc(5)), and an earlier launcher would not be known.
Result<posix::UniqueFd> take_state(const fs::path& state, const ServiceUser& service) {
    const fs::path file = state / "run.lock";
    auto lock = lock_as(service, file, Nanoseconds{0});
    if (lock || lock.error().code != ErrorCode::already_exists) return lock;
    const std::vector<board::linux::LockHolder> holders = board::linux::holders_of(file);
    for (const board::linux::LockHolder& holder : holders) {
        // The kernel keeps 15 bytes of a name; the sketch is called `printer`.
        if (holder.name == kProgramName.substr(0, 15))
            return already_running(state, board::linux::names_of(holders), service);
    }
    say_first("waiting for the processes of an earlier run to end: " + board::linux::names_of(holders));
    lock = lock_as(service, file, kPatience);
    if (lock || lock.error().code != ErrorCode::already_exists) return lock;
    return already_running(state, board::linux::names_of(board::linux::holders_of(file)), service);
}

/// "interrupts 9, task groups 2, …": the lines of a settings state file
/// (board/linux/kernel/host_settings.h), by kind.
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
    const auto read = posix::read_guarded(state_file, kSettingsBytesMax);
    for (std::string_view state = read ? std::string_view{*read} : std::string_view{}; !state.empty();) {
        const std::string_view line = cut(state, '\n');
        const auto kind =
            std::ranges::find_if(kKinds, [&](auto& each) { return line.starts_with(each.first); });
        if (kind != kKinds.end()) ++counts[static_cast<std::size_t>(kind - kKinds.begin())];
    }
    std::string changes;
    for (std::size_t i = 0; i < counts.size(); ++i) {
        if (counts[i] > 0) write(changes, changes.empty() ? "" : ", ", kKinds[i].second, ' ', counts[i]);
    }
    return changes;
}

bool is_asked_to_stop(int signals, int timeout_ms) {
    pollfd stop{signals, POLLIN, 0};
    return ::poll(&stop, 1, timeout_ms) > 0;
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
        return make_error(ErrorCode::unavailable, "cannot make ", o.state.native(), ": ", error.message());
    made->service_ = {::geteuid(), ::getegid()};
    const bool is_another = !o.service_user.empty();
    if (is_another) {
        QDUINO_TRY_ASSIGN(made->service_, find_or_make_user(o.service_user));
        QDUINO_TRY(rights::hand_over_state(o.state, made->service_.user, made->service_.group));
    }
    QDUINO_TRY_ASSIGN(made->state_lock_, take_state(o.state, made->service_));
    QDUINO_TRY(rights::keep_capabilities(kLauncherRights));
    {
        const posix::ActingAs service = made->as_service();
        fs::remove(o.state / "address", error);
        QDUINO_TRY_ASSIGN(made->log_, RunLog::make(o.state));
    }
    if (const int swept = board::linux::MemoryFolder::sweep(board::linux::MemoryFolder::kParent); swept > 0)
        made->say("removed what " + apps::counted(swept, "killed run") + " had left in memory");
    QDUINO_TRY_ASSIGN(made->memory_, board::linux::MemoryFolder::make(
                                         board::linux::MemoryFolder::kParent,
                                         is_another ? std::optional{made->service_.group} : std::nullopt));
    QDUINO_TRY(made->make_services_folder());
    made->link_ = LinkGiver{made->memory_.file("link")};
    // Before the sketch: its guarantee report then has the service's VCPU.
    made->service_vcpu_ = std::make_unique<ServiceVcpu>(
        o.speed > 0 ? std::nullopt : o.service_budget, o.service_budget_exactly,
        o.speed > 0 ? "the printer is simulated" : "lifted with --service-budget max",
        made->memory_.file("service-vcpu"));
    if (o.speed > 0) {
        made->plan_simulator();
    } else {
        QDUINO_TRY_ASSIGN(made->sketch_report_, SketchReport::make());
        QDUINO_TRY(made->life_.begin());
        made->plan_machine();
        made->plan_sketch();
    }
    if (!o.serial_port.empty()) made->plan_port();
    made->plan_service();
    made->name_ = made->plan_name();
    return made;
}

/// A process that runs `program`; it gets the machine file, if there is one, behind `words`.
ProcessPlan Launcher::plan_of(const char* name, const char* program, std::vector<std::string> words) const {
    ProcessPlan plan;
    plan.name = name;
    plan.command = std::move(words);
    plan.command.insert(plan.command.begin(), options_.programs / program);
    if (!options_.machine.empty()) plan.command.insert(plan.command.end(), {"--machine", options_.machine});
    return plan;
}

/// While it lives, files are touched by the rights of the service's user.
posix::ActingAs Launcher::as_service() const { return {service_.user, service_.group}; }

/// What the service makes for itself. Root's processes use nothing in it.
Result<void> Launcher::make_services_folder() const {
    const fs::path folder = memory_.file(kServicesFolder);
    QDUINO_TRY(posix::make_own_folder(folder, 0700));
    if (::geteuid() != 0 || ::chown(folder.c_str(), service_.user, service_.group) == 0) return {};
    return posix::system_error("give away", folder.native());
}

/// Where the machine and the sketch read what M500 keeps.
std::string Launcher::kept_settings() const { return memory_.file("kept-settings.toml"); }

/// Copies it from where the service writes it (apps/printd/kept_settings_file.h). The file may be
/// anything: a printer without its kept settings starts, and says so.
Result<void> Launcher::copy_kept_settings() const {
    const fs::path kept = options_.state / "kept-settings.toml";
    const Result<std::string> read = [&] {
        const posix::ActingAs service = as_service();
        return posix::read_guarded(kept, kKeptBytesMax, service_.user);
    }();
    if (read) return posix::replace_guarded(kept_settings(), *read, 0600);
    std::error_code ignored;
    fs::remove(kept_settings(), ignored);
    if (read.error().code != ErrorCode::not_found)
        say(text<std::string>("what M500 has kept does not count: ", read.error().message));
    return {};
}

Result<void> Launcher::before_sketch() {
    QDUINO_TRY(copy_kept_settings());
    return link_.make_anew();
}

/// Where the service listens for printer-port, which is its user's as well.
fs::path Launcher::services_port() const { return memory_.file(kServicesFolder) / "port"; }

void Launcher::add(ProcessPlan plan) {
    plan.log = &log_;
    processes_.push_back(std::make_unique<KeptProcess>(std::move(plan)));
}

void Launcher::plan_machine() {
    const fs::path pins = memory_.file("pins");
    ProcessPlan plan = plan_of("virtual machine", "virtual-machine",
                               {"--pins", pins, "--inspect", memory_.file("inspect"), "--stay-while-locked",
                                memory_.file("sketch.lock"), "--kept", kept_settings()});
    plan.ready = made_anew(pins);
    plan.before_start = [this] { return copy_kept_settings(); };
    plan.rights = kMachineRights;
    plan.after_end = [this] { processes_[1]->start_anew(); };
    add(std::move(plan));
}

void Launcher::plan_sketch() {
    const fs::path pins = memory_.file("pins"), link = apps::inherited_link(LinkGiver::kDescriptor);
    ProcessPlan plan =
        plan_of("sketch", "qduino-supervisor",
                {"--pins", pins, "--link", link, "--settings-state", options_.settings_state, "--starter",
                 life_.path(), "--", options_.programs / "printer", "--pins", pins, "--link", link, "--kept",
                 kept_settings(), "--report", sketch_report_.path()});
    if (options_.isolate) plan.command.emplace_back("--isolate");
    plan.in_child = [this] {
        link_.pass_on();
        sketch_report_.hand_on();
        life_.hand_on();
    };
    plan.before_start = [this] {
        sketch_report_.clear();
        return before_sketch();
    };
    plan.locks = memory_.file("sketch.lock");
    plan.rights = kSketchRights;
    plan.may_start = [this] { return processes_[0]->state() == KeptProcess::State::ready; };
    // Its link is there before its loops; it says what holds when they are about to run.
    plan.ready = [this](const std::string&) { return link_.look() && !sketch_report_.read().rest.empty(); };
    plan.after_end = [this] { put_settings_back(); };
    add(std::move(plan));
}

void Launcher::plan_simulator() {
    const fs::path link = apps::inherited_link(LinkGiver::kDescriptor);
    ProcessPlan plan = plan_of("simulated printer", "printer-sim",
                               {"--link", link, "--inspect", memory_.file("inspect"), "--speed",
                                text<std::string>(Shortest{options_.speed}), "--kept", kept_settings()});
    plan.before_start = [this] { return before_sketch(); };
    plan.in_child = [this] { link_.pass_on(); };
    plan.ready = [this](const std::string&) { return link_.look(); };
    plan.rights = kMachineRights;
    add(std::move(plan));
}

/// Outside the service's VCPU: an M112 may not wait for that.
void Launcher::plan_port() {
    ProcessPlan plan;
    plan.name = "serial port";
    plan.rights = kPortRights;
    plan.command = {options_.programs / "printer-port",
                    "--port",
                    options_.serial_port,
                    "--state",
                    options_.state,
                    "--link",
                    memory_.file("link"),
                    "--service",
                    services_port()};
    if (!options_.service_user.empty())
        plan.command.insert(plan.command.end(), {"--run-as", options_.service_user});
    plan.read_line = true;
    plan.ready = [](const std::string& line) { return line.ends_with('\n'); };
    add(std::move(plan));
}

void Launcher::plan_service() {
    ProcessPlan plan = plan_of(
        "print service", "printd",
        {"--state", options_.state, "--link", memory_.file("link"), "--inspect", memory_.file("inspect"),
         "--listen", text<std::string>('[', options_.listen, "]:", options_.port), "--ui", options_.ui,
         "--print-link", "--vcpu", service_vcpu_->file()});
    plan.in_child = [this] { service_vcpu_->enter(); };
    plan.rights = kServiceRights;
    if (!options_.service_user.empty())
        plan.command.insert(plan.command.end(), {"--run-as", options_.service_user});
    for (std::string& word : apps::words_of(options_.service)) plan.command.push_back(std::move(word));
    if (!options_.serial_port.empty())
        plan.command.insert(plan.command.end(), {"--serial-port", services_port()});
    if (!options_.serial_port.empty() && options_.serial_port != kPty)
        plan.command.emplace_back("--serial-wire");
    plan.read_line = true;
    // printd's own word. An answer on the port could be another program's.
    plan.ready = [](const std::string& line) { return line.ends_with('\n'); };
    add(std::move(plan));
}

/// Nobody else can come where the service listens for this computer alone.
std::unique_ptr<KeptProcess> Launcher::plan_name() const {
    if (options_.service.name.empty() || web::is_loopback_address(options_.listen)) return nullptr;
    ProcessPlan plan;
    plan.name = "name on the network";
    plan.command = {options_.programs / "printer-name", "--name",  options_.service.name, "--port",
                    text<std::string>(options_.port),   "--state", options_.state};
    if (!options_.service_user.empty())
        plan.command.insert(plan.command.end(), {"--run-as", options_.service_user});
    plan.read_line = true;
    plan.ready = [](const std::string& line) { return line.ends_with('\n'); };
    plan.rights = kServiceRights;
    plan.log = &log_;
    return std::make_unique<KeptProcess>(std::move(plan));
}

/// Undoes what a killed sketch had changed on this computer. Its supervisor does so, too, unless it
/// was killed with it.
void Launcher::put_settings_back() const {
    const auto restored = board::linux::restore_settings(options_.settings_state);
    if (restored && *restored == board::linux::Restored::undone)
        say("this computer's settings are as they were before");
}

/// Advances the first `started` processes once. False: one has failed for good, and was named.
bool Launcher::advance_all(std::size_t started) {
    const Instant now = monotonic_now();
    link_.serve();
    service_vcpu_->look(now, processes_.back()->alive());
    for (const auto& process : std::span{processes_}.first(started)) {
        process->advance(now);
        if (process->state() != KeptProcess::State::given_up) continue;
        say(text<std::string>("the ", process->name(), " ended with status ", process->ended().status,
                              " and will not come up. Stopping. It said:\n", process->last_words()));
        return false;
    }
    return true;
}

/// Now and then, while all run.
void Launcher::look_after_files(Instant now) {
    if (now - looked_at_ < kLookAtFilesEvery) return;
    looked_at_ = now;
    log_.keep_small();
    keep_report();
}

/// On a terminal, one line that the next one replaces.
void Launcher::show_step(std::string_view words) const {
    if (::isatty(STDOUT_FILENO) == 0) return;
    std::printf("\r%.*s\033[K", static_cast<int>(words.size()), words.data());
    std::fflush(stdout);
}

/// Starts the processes in order, each when the one before is ready.
bool Launcher::come_up(int signals) {
    for (std::size_t i = 0; i < processes_.size(); ++i) {
        show_step("Starting the " + processes_[i]->name() + " ...");
        const Instant until = monotonic_now() + kComeUpIn;
        do {
            if (!advance_all(i + 1)) return false;
            if (monotonic_now() > until) {
                say("the " + processes_[i]->name() + " has not come up within a minute. Stopping.");
                return false;
            }
            if (is_asked_to_stop(signals, kLookEveryMs)) return false;
        } while (processes_[i]->state() != KeptProcess::State::ready);
    }
    return true;
}

std::string Launcher::address() const {
    const std::string& line = processes_.back()->first_line();
    return line.substr(0, line.find_first_of(" \n"));
}

/// What others on the network need; nothing where they cannot come.
void Launcher::say_network() const {
    if (web::is_loopback_address(options_.listen)) return;
    const std::string words = network_words(processes_.back()->first_line(), options_.service.name,
                                            options_.port, ::isatty(STDOUT_FILENO) != 0);
    std::fputs(words.c_str(), stdout);
    std::fflush(stdout);
}

void Launcher::note_address() const {
    const posix::ActingAs service = as_service();
    static_cast<void>(posix::replace_guarded(options_.state / "address", address() + '\n', 0600));
}

/// What a serial host opens; empty: there is none.
std::string Launcher::serial_port() const {
    if (options_.serial_port != kPty) return options_.serial_port;
    const posix::ActingAs service = as_service();
    const fs::path link = options_.state / "serial";
    std::error_code error;
    return text<std::string>(link.native(), "  (now ", fs::read_symlink(link, error).native(), ')');
}

/// What the sketch says; of a simulated one, what there is to say.
SketchWords Launcher::sketch_words() const {
    if (options_.speed <= 0) return sketch_report_.read();
    return {.where = text<std::string>("Simulated, ", Shortest{options_.speed}, " times as fast."),
            .guarantees = "none in the simulator",
            .rest = ""};
}

/// All that holds, for people: kept in the state folder.
std::string Launcher::report() const {
    const SketchWords words = sketch_words();
    auto out = text<std::string>(words.where, "\nGuarantees: ", words.guarantees, ", ",
                                 service_vcpu_->in_a_line(), "\n\n", words.rest);
    out += apps::wrapped(service_vcpu_->words(), "");
    if (options_.isolate) {
        const std::string changes = changes_in(options_.settings_state);
        out += apps::wrapped(
            text<std::string>(
                "The stepper loop has a core of its own: other programs, interrupts and kernel work were "
                "moved off it. All of it is put back when the printer ends, also after a crash "
                "(--no-isolate leaves this computer as it is; steps are then late more often). ",
                changes.empty()
                    ? "Nothing could be changed: the lines above say why."
                    : "Changed until then: " + changes + " (each one in " + options_.settings_state + ")."),
            "");
    }
    return write(out, "\nUpload from a shell:\n  curl -H \"X-Api-Key: $(cat ", options_.state.native(),
                 "/api-key)\" \\\n    -F file=@part.gcode -F print=true http://127.0.0.1:", options_.port,
                 "/api/v1/jobs\n\nWhat the programs say: ", log_.path().native(), '\n');
}

/// Writes the report when it has changed.
void Launcher::keep_report() {
    std::string now = report();
    if (now == kept_report_) return;
    const posix::ActingAs service = as_service();
    if (posix::replace_guarded(options_.state / "report.txt", now, 0600)) kept_report_ = std::move(now);
}

std::string Launcher::screen() const {
    const SketchWords words = sketch_words();
    const auto machine = apps::read_machine_files(options_.machine, kept_settings());
    return first_screen({.took = age_of_this_process(),
                         .where = words.where,
                         .machine = machine ? std::string{machine->name.view()} : std::string{},
                         .address = address(),
                         .state = options_.state,
                         .serial = serial_port(),
                         .guarantees = words.guarantees,
                         .budget = service_vcpu_->in_a_line()});
}

/// True when it was asked to stop; false when a process has failed for good.
bool Launcher::keep(int signals) {
    while (advance_all(processes_.size())) {
        look_after_files(monotonic_now());
        if (name_) name_->advance(monotonic_now());
        if (is_asked_to_stop(signals, kLookEveryMs)) return true;
    }
    return false;
}

/// Stops in reverse order: the service, then the sketch, which drives its pins to their safe
/// states, then the machine.
void Launcher::stop_all() {
    if (name_) name_->end(kStopGrace);
    for (auto at = processes_.rbegin(); at != processes_.rend(); ++at) (*at)->end(kStopGrace);
    std::error_code ignored;
    const posix::ActingAs service = as_service();
    fs::remove(options_.state / "address", ignored);
}

int Launcher::run(int signals) {
    const bool up = come_up(signals);
    show_step("");
    if (up) {
        service_vcpu_->admit_again();
        note_address();
        keep_report();
        std::fputs(screen().c_str(), stdout);
        std::fflush(stdout);
        say_network();
    }
    const bool asked = up ? keep(signals) : is_asked_to_stop(signals, 0);
    stop_all();
    return asked ? 0 : 1;
}

}  // namespace qduino::launcher
