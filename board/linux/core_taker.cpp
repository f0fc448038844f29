#include "board/linux/core_taker.h"

#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <string>

#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/control_groups.h"
#include "board/linux/kernel/core_times.h"
#include "board/linux/kernel/device_interrupts.h"
#include "board/linux/kernel/kernel_text.h"
#include "board/linux/kernel/real_time_thread.h"
#include "board/linux/loop/crew.h"

namespace qduino::board::linux {

namespace {

/// Looks at what interrupts take: when less is remembered, and when that is.
constexpr std::size_t kLooksAtFirst = 25;
constexpr int kLooksLater = 5;

void join(FixedString<200>& text, std::string_view more) {
    if (more.empty()) return;
    write(text, text.empty() ? "" : "; ", more);
}

/// A look would take the pauses of its control group for interrupts.
bool group_is_throttled(const std::string& root) {
    constexpr double kUsual = 0.9;
    const auto group = real_time_group(root);
    return group && group->share() < kUsual;
}

/// The kernel never stops real-time threads to let ordinary ones run.
bool throttling_is_off(const std::string& root) {
    return text_of_file(root + "/proc/sys/kernel/sched_rt_runtime_us").starts_with("-1");
}

}  // namespace

// ---- changes to the computer --------------------------------------------------------------------

Result<void> CoreTaker::open_settings() {
    if (settings_.active()) return {};
    QDUINO_TRY_ASSIGN(settings_, HostSettings::open(config_.settings_state));
    return {};
}

/// One owner for each core of the computer. A sketch without real-time priorities starves nobody,
/// and owns nothing.
Result<void> CoreTaker::lock(std::span<const VcpuSpec> specs) {
    for (const VcpuSpec& spec : specs) {
        if (!spec.owns_core || !config_.real_time) continue;
        auto lock = CoreLock::take(spec.core, config_.core_patience, config_.sysfs_root);
        if (lock) {
            core_locks_.push_back(std::move(*lock));
        } else if (lock.error().code == ErrorCode::unavailable) {
            core_locks_.clear();
            return lock.error();
        } else {
            lock_shortfall_ = lock.error().message.view();
        }
    }
    return {};
}

void CoreTaker::take(std::span<const VcpuSpec> specs) {
    if (config_.real_time) {
        if (auto awake = keep_cores_awake(config_.sysfs_root); awake) awake_ = std::move(*awake);
    }
    for (const VcpuSpec& spec : specs) {
        if (std::ranges::count(cores_, spec.core, &UsedCore::core) > 0) continue;
        cores_.push_back({spec.core, spec.owns_core, {}, interrupt_counts_of(spec.core, config_.sysfs_root)});
    }
    if (config_.isolate) isolate(specs);
    if (config_.real_time && config_.probe_duration > Nanoseconds{0}) probe_owned_cores();
    take_bottom_halves(specs);
    started_at_ = monotonic_now();
}

void CoreTaker::isolate(std::span<const VcpuSpec> specs) {
    IsolationOptions options;
    options.cpus = core_count_;
    options.lift_throttling = config_.lift_throttling;
    options.root = config_.sysfs_root;
    for (const VcpuSpec& spec : specs) {
        if (spec.owns_core) options.cores.push_back(spec.core);
    }
    if (options.cores.empty()) return;
    const auto begin = [&]() -> Result<void> {
        QDUINO_TRY(open_settings());
        QDUINO_TRY_ASSIGN(isolation_, Isolation::begin(settings_, options));
        return {};
    };
    const Result<void> done = begin();
    if (done) return;
    const bool needs_root = done.error().code == ErrorCode::not_permitted;
    isolation_shortfall_ =
        needs_root ? "to have its core isolated, run as root" : done.error().message.view();
}

void CoreTaker::probe_owned_cores() {
    for (UsedCore& used : cores_) {
        if (!used.owned) continue;
        const auto enter = [&] {
            if (isolation_.owns(used.core)) {
                static_cast<void>(isolation_.adopt(used.core, static_cast<pid_t>(::syscall(SYS_gettid))));
            }
        };
        used.probe = probe_core(used.core, config_.probe_duration, config_.priority_highest, enter);
        used.interrupts_at_start = interrupt_counts_of(used.core, config_.sysfs_root);
    }
}

const Neighbours& CoreTaker::neighbours(int core) {
    const auto [known, is_new] = neighbours_.try_emplace(core);
    if (is_new) known->second = neighbours_on(core, config_.sysfs_root);
    return known->second;
}

const Interference& CoreTaker::interference(int core) {
    const auto [known, is_new] = known_.try_emplace(core);
    auto& [memory, told, said, refused] = known->second;
    if (!is_new || config_.probe_duration == Nanoseconds{0}) return told;
    if (const char* text = std::getenv("QDUINO_INTERRUPTS")) {
        if (const auto figures = InterferenceMemory::figures_said(text)) {
            said = told.measured = true;
            told.found_ppm = figures->share_ppm;
            told.counts = *figures;
            return told;
        }
        refused = true;
    }
    memory = InterferenceMemory::read(core, config_.sysfs_root);
    if (!group_is_throttled(config_.sysfs_root) && (memory.size() == 0 || !neighbours(core).loops)) {
        const int count = memory.size() < kLooksAtFirst ? static_cast<int>(kLooksAtFirst) : kLooksLater;
        memory.add(look_for_interference(core, config_.priority_highest, count));
    }
    told = memory.interference();
    // Where it cannot be written, the next start looks for longer.
    if (told.measured) static_cast<void>(memory.write(core, config_.sysfs_root));
    return told;
}

/// A look for each second, but no more than a fifth of all that are remembered.
void CoreTaker::remember_run() {
    const Nanoseconds running = monotonic_now() - started_at_;
    for (const UsedCore& used : cores_) {
        const auto known = known_.find(used.core);
        const auto now = interrupt_counts_of(used.core, config_.sysfs_root);
        if (known == known_.end() || !now || !used.interrupts_at_start || running < 1s) continue;
        auto& [memory, told, said, refused] = known->second;
        if (said) continue;
        const auto look = look_of_run(told, running, now->others - used.interrupts_at_start->others);
        if (!look) continue;
        const auto seconds = static_cast<std::size_t>(running / 1s);
        memory.add_run(*look, std::min(seconds, InterferenceMemory::kRuns / 5));
        static_cast<void>(memory.interference());
        static_cast<void>(memory.write(used.core, config_.sysfs_root));
    }
}

void CoreTaker::give_back() {
    static_cast<void>(settings_.undo());
    remember_run();
}

void CoreTaker::serve_interrupts(DeviceClass device, VcpuId io) {
    for (std::size_t i = 0; i < served_by_.size(); ++i) {
        if (device == DeviceClass::all || i == static_cast<std::size_t>(device)) served_by_[i] = io;
    }
}

void CoreTaker::take_bottom_halves(std::span<const VcpuSpec> specs) {
    for (std::size_t i = 0; i < served_by_.size(); ++i) {
        const auto spec = std::ranges::find(specs, served_by_[i], &VcpuSpec::id);
        if (served_by_[i] == kNoVcpu || spec == specs.end()) continue;
        take_kernel_threads(static_cast<DeviceClass>(i), *spec,
                            std::max(1, priority_of(*spec, specs, config_)));
    }
}

/// They get their rank later, when somebody watches them: at the rank of a loop, and with no limit,
/// one could keep the threads of this board from coming up.
void CoreTaker::take_kernel_threads(DeviceClass device, const VcpuSpec& io, int priority) {
    FixedString<160>& note = served_note_[static_cast<std::size_t>(device)];
    const auto threads = bottom_halves_of(device, config_.sysfs_root);
    write(note, name_of(device), ": ");
    if (threads.empty()) {
        write(note, "its bottom halves are no threads of this kernel: boot with threadirqs",
              device == DeviceClass::nic ? ", or set threaded in /sys/class/net/DEV" : "");
        return;
    }
    Result<void> done = open_settings();
    std::size_t taken = 0;
    for (const BottomHalf& thread : threads) {
        if (!done || kernel_threads_.full()) break;
        done = settings_.take_thread(thread.tid, io.core);
        if (!done) break;
        kernel_threads_.push_back({.io = io.id, .tid = thread.tid, .priority = priority});
        ++taken;
    }
    if (!done) {
        write(note, done.error().message);
        return;
    }
    write(note, taken, taken == 1 ? " kernel thread" : " kernel threads", " at its priority");
    if (taken < threads.size()) write(note, ", and no more than that of ", threads.size());
}

Result<void> CoreTaker::route_interrupts(DeviceClass device, int core, bool allowed) {
    if (core < 0 || core >= core_count_) return make_error(ErrorCode::invalid_argument, "no such core");
    if (interrupts_of_class(device, config_.sysfs_root).empty()) {
        return make_error(ErrorCode::not_found, name_of(device),
                          ": no interrupt of this device class on this computer");
    }
    QDUINO_TRY(open_settings());
    int stuck = 0;
    const int moved = route_class(settings_, device, core, core_count_, allowed, stuck, config_.sysfs_root);
    if (stuck == 0 || moved > 0) return {};
    return make_error(ErrorCode::not_permitted, name_of(device),
                      ": the kernel does not let its interrupts be moved (not root, or managed)");
}

Result<void> CoreTaker::core_timer(int core, bool enabled) const {
    const bool tickless = tickless_cores(config_.sysfs_root).has(core);
    if (tickless != enabled) return {};  // as it is
    if (tickless) {
        return make_error(ErrorCode::unsupported, "the kernel was booted to stop the tick of core ", core,
                          " by itself");
    }
    return make_error(ErrorCode::unsupported, "the tick of core ", core,
                      " stops only when booted with nohz_full=", core);
}

// ---- what holds ---------------------------------------------------------------------------------

LoopGuarantee CoreTaker::describe(const VcpuThread& thread) const {
    const VcpuSpec& spec = thread.spec();
    LoopGuarantee loop{spec};
    loop.budget = thread.parameters().budget;
    loop.period = thread.parameters().period;
    loop.priority_enforced = thread.real_time() && thread.pinned();
    loop.budget_enforced = thread.budget_kept() || spec.owns_core;
    const bool alone = isolation_.owns(spec.core) && isolation_.exclusive() && loop.priority_enforced;
    loop.core_owned = spec.owns_core && alone && throttling_is_off(config_.sysfs_root);
    join(loop.shortfall, thread.shortfall());
    if (!config_.real_time) join(loop.shortfall, "SCHED_FIFO was not asked for");
    if (!config_.enforce_budgets && !spec.owns_core)
        join(loop.shortfall, "budgets are not enforced, as configured");
    if (spec.owns_core && !config_.isolate) {
        join(loop.shortfall, "its core is open to others: let the board isolate it, as root");
        if (thread.rests()) join(loop.shortfall, "pauses of 0.1 ms keep it within RT throttling");
    } else if (spec.owns_core && !isolation_shortfall_.empty()) {
        join(loop.shortfall, isolation_shortfall_);
    } else if (spec.owns_core && !loop.core_owned) {
        join(loop.shortfall,
             alone ? "RT throttling may take 50 ms of each second" : "others may run on its core");
    }
    for (std::size_t i = 0; i < served_by_.size(); ++i) {
        if (served_by_[i] == spec.id) join(loop.shortfall, served_note_[i]);
    }
    return loop;
}

/// Whether more interrupts came than were counted. On a core that a loop owns nothing is counted.
/// The alarms of the loops themselves are counted with their releases.
void CoreTaker::compare_with_admission(const UsedCore& used, std::optional<InterruptCounts> now,
                                       CoreGuarantee& report) const {
    const auto known = known_.find(report.core);
    if (known == known_.end() || !known->second.told.measured) return;
    const Interference& told = known->second.told;
    if (known->second.said) {
        join(report.note, "interrupts are counted as QDUINO_INTERRUPTS says");
        return;
    }
    if (known->second.refused)
        join(report.note,
             "QDUINO_INTERRUPTS is malformed, and counts for nothing (four numbers: "
             "docs/qduino.md)");
    report.counted_per_second = told.counted_per_second();
    report.counted_cost = told.each;
    report.counted_share = static_cast<double>(told.counts.share_ppm) * 1e-6;
    report.counted_at_once = told.counts.at_once();
    if (report.worst_gap < told.worst) report.worst_gap = told.worst;
    const Nanoseconds running = monotonic_now() - started_at_;
    if (now && used.interrupts_at_start && running > 100ms) {
        const auto others = static_cast<double>(now->others - used.interrupts_at_start->others);
        report.without_alarms_per_second = told.ticks_per_second + others / to_seconds(running);
    }
    if (report.without_alarms_per_second > report.counted_per_second)
        join(report.note, "more interrupts came than admission counts: a loop's R may be longer");
    if (told.stalls > 0)
        join(report.note, text<std::string>("stalls, which admission does not count, in ", told.stalls,
                                            " of ", told.looks, " looks of ", kInterferenceLook, ", up to ",
                                            told.worst, " in one piece: a loop that one hits may be late"));
}

CoreGuarantee CoreTaker::describe(const UsedCore& used) const {
    CoreGuarantee report;
    report.core = used.core;
    report.tick_stopped = used.owned && tickless_cores(config_.sysfs_root).has(used.core);
    report.throttling_lifted = throttling_is_off(config_.sysfs_root);
    const auto interrupts = interrupt_counts_of(used.core, config_.sysfs_root);
    const Nanoseconds running = monotonic_now() - started_at_;
    if (used.probe) {
        report.worst_gap = used.probe->worst_gap;
        report.interrupts_per_second = used.probe->interrupts_per_second;
    }
    if (interrupts && used.interrupts_at_start &&
        running > 100ms) {  // what really came since, once that says something
        report.interrupts_per_second =
            static_cast<double>(interrupts->all() - used.interrupts_at_start->all()) / to_seconds(running);
    }
    compare_with_admission(used, interrupts, report);
    if (config_.real_time && !awake_.valid())
        join(report.note, "idle cores may sleep deeply: late wake-ups (run as root)");
    if (!used.owned) return report;
    if (isolated_cores(config_.sysfs_root).has(used.core)) join(report.note, "set apart at boot (isolcpus)");
    if (!report.tick_stopped) {
        join(report.note, text<std::string>("to stop its tick, boot with nohz_full=", used.core));
    }
    join(report.note, lock_shortfall_);
    for (const std::string& note : isolation_.notes()) join(report.note, note);
    return report;
}

void CoreTaker::describe_cores(GuaranteeReport& report) const {
    for (const UsedCore& used : cores_) {
        if (!report.cores.full()) report.cores.push_back(describe(used));
    }
}

}  // namespace qduino::board::linux
