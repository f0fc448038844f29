#include "qduino/trace/kernel_trace.h"

#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>

#include "board/linux/loop/budget_keeper.h"
#include "posix/small_file.h"
#include "report/chrome_event.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;
using picture::Doing;

constexpr const char* kOurThreads = "comm ~ \"loop *\" || comm ~ \"io *\"";
constexpr const char* kOurSwitches =
    "prev_comm ~ \"loop *\" || next_comm ~ \"loop *\" || prev_comm ~ \"io *\" || next_comm ~ \"io *\"";
constexpr const char* kBufferKib = "8192";  // for each core

template <typename T>
std::optional<T> number_at(std::string_view text) {
    while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
    T value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc{} ? std::optional<T>(value) : std::nullopt;
}

/// The text between `key` and `end` (or the end of the line); empty when there is no such key.
std::string_view field(std::string_view fields, std::string_view key, std::string_view end) {
    const std::size_t at = fields.find(key);
    if (at == std::string_view::npos) return {};
    const std::string_view rest = fields.substr(at + key.size());
    return rest.substr(0, rest.find(end));
}

std::string name_of(int vcpu) { return text<std::string>(vcpu <= 32 ? "loop " : "io ", vcpu); }

/// "1234.567890" in microseconds: exact, as far as a computer has been up.
std::optional<std::int64_t> microseconds(std::string_view text) {
    const auto seconds = number_at<double>(text);
    return seconds ? std::optional<std::int64_t>(std::llround(*seconds * 1e6)) : std::nullopt;
}

/// Text as JSON takes it between quotes.
std::string plain(std::string_view text) {
    std::string out;
    for (const char c : text) {
        if (c >= ' ' && c != '"' && c != '\\') out += c;
    }
    return out;
}

}  // namespace

// ---- reading ------------------------------------------------------------------------------------

void KernelTraceReader::line(std::string_view text) {
    if (text.starts_with('#')) return head(text);
    // "          loop 1-1234    [000] d..2.   123.456789: sched_switch: prev_comm=…"
    const std::size_t bracket = text.find(" [");
    const auto core =
        bracket == std::string_view::npos ? std::nullopt : number_at<int>(text.substr(bracket + 2));
    const std::size_t colon = text.find(": ", bracket == std::string_view::npos ? 0 : bracket);
    if (!core || colon == std::string_view::npos) return;
    const auto us = microseconds(text.substr(text.rfind(' ', colon - 1) + 1));
    const std::string_view rest = text.substr(colon + 2);
    const std::size_t name_end = rest.find(':');
    if (!us || name_end == std::string_view::npos) return;
    const std::string_view name = rest.substr(0, name_end);
    const Event event{*core, since_start(*us), rest.substr(name_end + 1)};
    last_us_ = std::max(last_us_, event.us);
    if (name == "sched_switch") {
        switched(event);
    } else if (name == "sched_wakeup" || name == "sched_wakeup_new") {
        woken(event);
    } else if (name == "signal_deliver") {
        signalled(event, vcpu_of(text.substr(0, bracket)));
    } else if (name == "sys_enter") {  // filtered: rt_sigreturn alone
        in_handler_.erase(vcpu_of(text.substr(0, bracket)));
    } else if (name == "sched_process_fork") {
        forked(event);
    } else if (name == "irq_handler_entry") {
        interrupt_begins(event, field(event.fields, "name=", " "));
    } else if (name == "local_timer_entry") {
        interrupt_begins(event, "local timer");
    } else if (name == "irq_handler_exit" || name == "local_timer_exit") {
        interrupt_ends(event);
    }
}

/// "# entries-in-buffer/entries-written: 12/15   #P:2"
void KernelTraceReader::head(std::string_view text) {
    const std::string_view counts = field(text, "entries-written: ", " ");
    const auto held = number_at<std::int64_t>(counts);
    const std::size_t slash = counts.find('/');
    if (!held || slash == std::string_view::npos) return;
    lost_ = number_at<std::int64_t>(counts.substr(slash + 1)).value_or(*held) - *held;
}

std::int64_t KernelTraceReader::since_start(std::int64_t us) {
    if (!start_us_) start_us_ = us;
    return us - *start_us_;
}

void KernelTraceReader::instant(int core, int vcpu, std::int64_t us, const char* name) {
    cores_[core].vcpus.insert(vcpu);
    cores_[core].records.push_back(chrome::instant(name, core, vcpu, us));
}

void KernelTraceReader::end_stretch(int core, std::int64_t us) {
    Running& running = cores_[core].running;
    if (running.vcpu == 0) return;
    cores_[core].vcpus.insert(running.vcpu);
    cores_[core].records.push_back(
        chrome::stretch(name_of(running.vcpu), core, running.vcpu, running.since_us, us - running.since_us));
    running.vcpu = 0;
    ++stretches_;
}

void KernelTraceReader::forked(const Event& event) {
    const auto parent = number_at<int>(field(event.fields, " pid=", " "));
    const auto child = number_at<int>(field(event.fields, "child_pid=", " "));
    if (parent && child && family_.contains(*parent)) family_.insert(*child);
}

/// N of our "loop N" and "io N"; 0: another thread.
int KernelTraceReader::vcpu_of(std::string_view comm, std::string_view pid) const {
    for (const std::string_view kind : {std::string_view("loop "), std::string_view("io ")}) {
        if (!comm.starts_with(kind) || !family_.contains(number_at<int>(pid).value_or(0))) continue;
        return number_at<int>(comm.substr(kind.size())).value_or(0);
    }
    return 0;
}

/// The same for "   loop 1-1234   ", the task of a line.
int KernelTraceReader::vcpu_of(std::string_view task) const {
    while (task.starts_with(' ')) task.remove_prefix(1);
    const std::size_t dash = task.rfind('-');
    return dash == std::string_view::npos ? 0 : vcpu_of(task.substr(0, dash), task.substr(dash + 1));
}

void KernelTraceReader::switched(const Event& event) {
    const int before =
        vcpu_of(field(event.fields, "prev_comm=", " prev_pid="), field(event.fields, "prev_pid=", " "));
    const int after =
        vcpu_of(field(event.fields, "next_comm=", " next_pid="), field(event.fields, "next_pid=", " "));
    if (before != 0) {
        end_stretch(event.core, event.us);
        const bool ready = field(event.fields, "prev_state=", " ").starts_with('R');
        const bool spent = in_handler_.contains(before);
        instant(event.core, before, event.us, ready ? "preempt" : spent ? "throttle" : "block");
        tell(event, before, ready ? Doing::waits : spent ? Doing::throttled : Doing::nothing);
    }
    if (after == 0) return;
    Core& core = cores_[event.core];
    core.has_loops = true;
    core.running = {after, event.us};
    tell(event, after, Doing::runs);
}

void KernelTraceReader::woken(const Event& event) {
    const int vcpu = vcpu_of(field(event.fields, "comm=", " pid="), field(event.fields, " pid=", " "));
    const auto core = number_at<int>(field(event.fields, "target_cpu=", " "));
    if (vcpu == 0 || !core) return;
    instant(*core, vcpu, event.us, "wake");
    if (!picture_) return;
    picture_->woke(*core, static_cast<sched::VcpuId>(vcpu), event.us, in_handler_.contains(vcpu));
}

void KernelTraceReader::tell(const Event& event, int vcpu, picture::Doing doing) {
    if (picture_) picture_->does(event.core, static_cast<sched::VcpuId>(vcpu), doing, event.us);
}

void KernelTraceReader::signalled(const Event& event, int vcpu) {
    if (vcpu == 0 || number_at<int>(field(event.fields, "sig=", " ")) != budget_signal_) return;
    in_handler_.insert(vcpu);
    instant(event.core, vcpu, event.us, "budget timer");
}

void KernelTraceReader::interrupt_begins(const Event& event, std::string_view name) {
    Core& core = cores_[event.core];
    core.interrupt_since_us = event.us;
    core.interrupt = plain(name);
}

void KernelTraceReader::interrupt_ends(const Event& event) {
    Core& core = cores_[event.core];
    if (core.interrupt_since_us < 0) return;
    core.records.push_back(chrome::stretch("interrupt", event.core, chrome::kInterruptThread,
                                           core.interrupt_since_us, event.us - core.interrupt_since_us,
                                           chrome::device(core.interrupt)));
    if (picture_) picture_->taken(event.core, core.interrupt_since_us, event.us, core.interrupt);
    core.interrupt_since_us = -1;
}

std::string KernelTraceReader::chrome_json() {
    std::string json = "[";
    const auto add = [&json](const std::string& record) {
        json += (json.size() > 1 ? ",\n" : "\n") + record;
    };
    for (auto& [number, core] : cores_) {
        if (!core.has_loops) continue;
        end_stretch(number, last_us_);
        add(chrome::core_name(number));
        add(chrome::thread_name(number, chrome::kInterruptThread, "interrupts"));
        for (const int vcpu : core.vcpus) add(chrome::thread_name(number, vcpu, name_of(vcpu)));
        for (const std::string& record : core.records) add(record);
    }
    return json + "\n]\n";
}

// ---- recording ----------------------------------------------------------------------------------

Result<KernelTracer> KernelTracer::start() {
    if (::geteuid() != 0) {
        return make_error(ErrorCode::not_permitted,
                          "on Linux it is the kernel that schedules, and only root may record what it does: "
                          "run this as root. (In virtual time, without --linux, everything is recorded.)");
    }
    for (const char* root : {"/sys/kernel/tracing", "/sys/kernel/debug/tracing"}) {
        const fs::path instances = fs::path(root) / "instances";
        if (::access(instances.c_str(), F_OK) != 0) continue;
        const fs::path mine = instances / ("qduino-" + std::to_string(::getpid()));
        if (::mkdir(mine.c_str(), 0700) != 0) {
            return make_error(ErrorCode::unavailable,
                              "the kernel's tracer cannot be had: ", std::strerror(errno));
        }
        KernelTracer tracer(mine);
        QDUINO_TRY(tracer.set_up());
        return tracer;
    }
    return make_error(ErrorCode::not_found,
                      "the kernel's tracer is not mounted: run 'mount -t tracefs nodev /sys/kernel/tracing' "
                      "first");
}

KernelTracer::~KernelTracer() {
    if (instance_.empty()) return;
    static_cast<void>(write("tracing_on", "0"));
    ::rmdir(instance_.c_str());  // the kernel's way to say that the instance may go
}

Result<void> KernelTracer::write(const std::string& file, const std::string& text) {
    if (posix::write_small_file(instance_ / file, text)) return {};
    return make_error(ErrorCode::unavailable, "the kernel's tracer does not take ", text, " for ", file);
}

Result<void> KernelTracer::set_up() {
    const std::string signal = "sig == " + std::to_string(board::linux::BudgetKeeper::signal_number());
    const std::vector<std::pair<std::string, std::string>> settings{
        {"tracing_on", "0"},
        {"buffer_size_kb", kBufferKib},
        {"trace_clock", "mono"},
        {"events/sched/sched_switch/filter", kOurSwitches},
        {"events/sched/sched_wakeup/filter", kOurThreads},
        {"events/signal/signal_deliver/filter", signal},
        {"events/sched/sched_switch/enable", "1"},
        {"events/sched/sched_wakeup/enable", "1"},
        {"events/sched/sched_process_fork/enable", "1"},
        {"events/signal/signal_deliver/enable", "1"},
        {"events/raw_syscalls/sys_enter/filter", "id == " + std::to_string(SYS_rt_sigreturn)},
        {"events/raw_syscalls/sys_enter/enable", "1"},
        {"events/irq/irq_handler_entry/enable", "1"},
        {"events/irq/irq_handler_exit/enable", "1"},
    };
    for (const auto& [file, text] : settings) {
        QDUINO_TRY(write(file, text));
    }
    // The timer's own interrupt is a vector of its own on x86 alone.
    for (const char* event :
         {"events/irq_vectors/local_timer_entry/enable", "events/irq_vectors/local_timer_exit/enable"}) {
        if (::access((instance_ / event).c_str(), F_OK) == 0) static_cast<void>(write(event, "1"));
    }
    return write("tracing_on", "1");
}

Result<void> KernelTracer::stop(KernelTraceReader& reader) {
    QDUINO_TRY(write("tracing_on", "0"));
    std::ifstream text(instance_ / "trace");
    if (!text) return make_error(ErrorCode::unavailable, "what the kernel's tracer recorded cannot be read");
    for (std::string line; std::getline(text, line);) reader.line(line);
    return {};
}

}  // namespace qduino::apps
