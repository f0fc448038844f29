#include "board/linux/computer/isolation.h"

#include <unistd.h>

#include <initializer_list>
#include <set>

#include "base/text.h"
#include "base/whole_number.h"
#include "board/linux/kernel/device_interrupts.h"
#include "board/linux/kernel/kernel_text.h"

namespace qduino::board::linux {

using posix::read_small_file;
using posix::write_small_file;
namespace {

bool exists(const std::string& path) { return ::access(path.c_str(), F_OK) == 0; }

bool mentions(std::string_view text, std::string_view word) {
    return text.find(word) != std::string_view::npos;
}

/// The tasks of a v1 set.
std::vector<std::string> tasks_of(const std::string& set) {
    const std::string text = text_of_file(set + "/tasks");
    const auto tasks = words(text);
    return {tasks.begin(), tasks.end()};
}

/// Writes each value to its file in `folder`, in order. Error: the first that is refused.
using Values = std::initializer_list<std::pair<const char*, std::string_view>>;
Result<void> write_all_of(const std::string& folder, Values values) {
    for (const auto& [file, value] : values) QDUINO_TRY(write_small_file(folder + file, value));
    return {};
}

/// Moves the tasks of one v1 set to another, until a look finds none that is new. Kernel threads
/// that are bound to a core refuse to move.
void move_all_tasks(const std::string& from, const std::string& to) {
    std::set<std::string, std::less<>> tried;
    for (bool found_new = true; found_new;) {
        found_new = false;
        for (const std::string& task : tasks_of(from)) {
            if (!tried.insert(task).second) continue;
            found_new = true;
            static_cast<void>(write_small_file(to + "/tasks", task));
        }
    }
}

}  // namespace

Result<Isolation> Isolation::begin(HostSettings& settings, const IsolationOptions& options) {
    Isolation isolation;
    isolation.options_ = options;
    for (const int core : options.cores) isolation.owned_.add(core);
    isolation.rest_ = CpuList::first(options.cpus).without(isolation.owned_);
    if (isolation.rest_.empty()) {
        return make_error(ErrorCode::out_of_range,
                          "no core would be left for the rest of the computer: let loops own fewer cores");
    }

    const std::string v1 = isolation.at("/sys/fs/cgroup/cpuset");
    const std::string controllers = text_of_file(isolation.at("/sys/fs/cgroup/cgroup.controllers"));
    if (exists(v1 + "/cpuset.cpus")) {
        isolation.take_cores_v1(settings);
    } else if (mentions(controllers, "cpuset")) {
        isolation.take_cores_v2(settings);
    } else {
        isolation.notes_.push_back("no cpuset controller is mounted: other tasks stay on the core");
    }
    isolation.move_interrupts(settings);
    isolation.move_network(settings);
    isolation.move_kernel_work(settings);
    isolation.stay_fast(settings);
    if (options.lift_throttling && isolation.exclusive()) isolation.lift_throttling(settings);
    return isolation;
}

bool Isolation::try_change(HostSettings& settings, const std::string& path, std::string_view text,
                           std::string_view what) {
    const auto changed = settings.change(path, text);
    if (!changed) notes_.push_back(qduino::text<std::string>(what, ": ", changed.error().message));
    return changed.ok();
}

/// `cpus` without the owned cores, or, when nothing is left, all others; nothing when it has none
/// of them.
std::optional<CpuList> Isolation::left_of(const CpuList& cpus) const {
    const CpuList left = cpus.without(owned_);
    if (left == cpus) return std::nullopt;
    return left.empty() ? rest_ : left;
}

// ---- 1. tasks -----------------------------------------------------------------------------------

/// Takes our cores out of every child set of the root: the sets of cores must not overlap.
void Isolation::shrink_other_sets_v1(HostSettings& settings, const std::string& top) {
    for (const std::string& name : entries(top)) {
        const std::string cpus = top + "/" + name + "/cpuset.cpus";
        if (name.starts_with("qduino-") || !exists(cpus)) continue;
        const auto left = left_of(read_cpu_list(cpus));
        if (!left) continue;
        // Children first: a child is never larger than its parent.
        shrink_other_sets_v1(settings, top + "/" + name);
        try_change(settings, cpus, left->to_list(), "cpuset " + name);
    }
}

/// The sets of the owned cores, beside `system` for the rest; all have the memory of `nodes`.
Result<void> Isolation::make_sets_v1(HostSettings& settings, const std::string& system,
                                     std::string_view nodes) const {
    QDUINO_TRY(settings.make_group(system));
    QDUINO_TRY(write_all_of(system, {{"/cpuset.cpus", rest_.to_list()}, {"/cpuset.mems", nodes}}));
    for (const int core : options_.cores) {
        const std::string number = std::to_string(core);
        const std::string own = at("/sys/fs/cgroup/cpuset/qduino-core") + number;
        QDUINO_TRY(settings.make_group(own));
        QDUINO_TRY(write_all_of(own, {{"/cpuset.cpus", number},
                                      {"/cpuset.mems", nodes},
                                      {"/cpuset.cpu_exclusive", "1"},
                                      {"/cpuset.sched_load_balance", "0"}}));
    }
    return {};
}

void Isolation::take_cores_v1(HostSettings& settings) {
    const std::string top = at("/sys/fs/cgroup/cpuset");
    const std::string nodes = text_of_file(top + "/cpuset.mems");
    // First, so that it is undone last, when the tasks are back in the root set.
    for (const std::string& task : tasks_of(top))
        static_cast<void>(settings.remember_affinity(whole_number<pid_t>(task).value_or(-1)));
    shrink_other_sets_v1(settings, top);

    const std::string system = top + "/qduino-system";
    if (!make_sets_v1(settings, system, nodes.empty() ? "0" : nodes)) {
        notes_.push_back("cpusets: cannot make exclusive sets under " + top);
        return;
    }
    move_all_tasks(top, system);
    // The root no longer balances load over all cores; `qduino-system` does so over the rest.
    try_change(settings, top + "/cpuset.sched_load_balance", "0", "load balancing");
    cpusets_ = Cpusets::v1;
}

void Isolation::take_cores_v2(HostSettings& settings) {
    const std::string top = at("/sys/fs/cgroup");
    const std::string control = top + "/cgroup.subtree_control";
    // Stays enabled afterwards: it changes nothing by itself, and other programs may have come to
    // rely on it.
    if (!mentions(text_of_file(control), "cpuset") && !write_small_file(control, "+cpuset")) {
        notes_.push_back("cpusets: cannot enable the cpuset controller in " + top);
        return;
    }
    for (const int core : options_.cores) {
        const std::string number = std::to_string(core);
        const std::string own = top + "/qduino-core" + number;
        const bool made =
            settings.make_group(own) && write_all_of(own, {{"/cgroup.type", "threaded"},
                                                           {"/cpuset.cpus", number},
                                                           {"/cpuset.cpus.partition", "isolated"}});
        const auto state = read_small_file(own + "/cpuset.cpus.partition");
        if (!made || !state || mentions(*state, "invalid")) {
            notes_.push_back("cpusets: the kernel gives no isolated partition for core " + number);
            return;
        }
    }
    cpusets_ = Cpusets::v2;
}

Result<void> Isolation::adopt(int core, pid_t tid) const {
    const std::string thread = std::to_string(tid);
    const std::string name = "/qduino-core" + std::to_string(core);
    if (cpusets_ == Cpusets::v1)
        return write_small_file(at("/sys/fs/cgroup/cpuset") + name + "/tasks", thread);
    if (cpusets_ == Cpusets::none) return {};
    // Threads of a process share a domain: this process enters the root's, whose threaded child the
    // core's set is.
    const std::string top = at("/sys/fs/cgroup");
    QDUINO_TRY(write_small_file(top + "/cgroup.procs", std::to_string(::getpid())));
    return write_small_file(top + name + "/cgroup.threads", thread);
}

// ---- 2. interrupts and kernel work --------------------------------------------------------------

void Isolation::move_interrupts(HostSettings& settings) {
    try_change(settings, at("/proc/irq/default_smp_affinity"), rest_.to_mask(options_.cpus),
               "default interrupt affinity");
    for (const Interrupt& irq : all_interrupts(options_.root)) {
        const auto left = left_of(irq.allowed);
        if (!left) continue;
        const std::string path = at("/proc/irq/") + irq.number + "/smp_affinity_list";
        if (irq.movable && settings.change(path, left->to_list())) continue;
        if (irq.used && left_of(irq.target)) kept_interrupts_.push_back(irq.name());
    }
    if (!kept_interrupts_.empty()) note_kept_interrupts();
}

void Isolation::note_kept_interrupts() {
    const bool one = kept_interrupts_.size() == 1;
    auto note = text<std::string>(one ? "interrupt " : "interrupts ");
    for (const std::string& name : kept_interrupts_)
        write(note, &name == &kept_interrupts_[0] ? "" : ", ", name);
    notes_.push_back(write(note, one ? " stays" : " stay", " on the core: to let the kernel place ",
                           one ? "it" : "them", " elsewhere, boot with isolcpus=managed_irq,",
                           owned_.to_list()));
}

void Isolation::move_network(HostSettings& settings) {
    const std::string devices = at("/sys/class/net");
    for (const std::string& device : entries(devices)) {
        const std::string queues = devices + "/" + device + "/queues";
        for (const std::string& queue : entries(queues)) {
            for (const char* file : {"/rps_cpus", "/xps_cpus"}) {
                const std::string path = queues + "/" + queue + file;
                const auto left = left_of(CpuList::from_mask(text_of_file(path)).value_or(CpuList{}));
                if (left) try_change(settings, path, left->to_mask(options_.cpus), "network queue " + queue);
            }
        }
    }
}

void Isolation::move_kernel_work(HostSettings& settings) {
    const std::string mask = rest_.to_mask(options_.cpus);
    try_change(settings, at("/sys/devices/virtual/workqueue/cpumask"), mask, "unbound workqueues");
    const std::string watchdog = at("/proc/sys/kernel/watchdog_cpumask");
    if (exists(watchdog)) try_change(settings, watchdog, rest_.to_list(), "watchdog");
    const std::string vmstat = at("/proc/sys/vm/stat_interval");
    // vmstat's work on each core comes every 2 min instead of every second.
    if (exists(vmstat)) try_change(settings, vmstat, "120", "vmstat");
}

// ---- 3. and 4. ----------------------------------------------------------------------------------

void Isolation::stay_fast(HostSettings& settings) {
    for (const int core : options_.cores) {
        const std::string governor =
            at("/sys/devices/system/cpu/cpu") + std::to_string(core) + "/cpufreq/scaling_governor";
        if (exists(governor)) try_change(settings, governor, "performance", "governor");
    }
}

// Threads finish what an interrupt begins, and the kernel binds them to the same core: for a disk,
// they handle the requests behind the one that is done. A loop that spins would keep them waiting
// for ever, and with them every task that waits for the disk. They get their share from the fair
// server (since Linux 6.12) or else from the throttling.
void Isolation::lift_throttling(HostSettings& settings) {
    const bool needed = !kept_interrupts_.empty();
    if (needed && !release_at_least(text_of_file(at("/proc/sys/kernel/osrelease")), 6, 12)) {
        notes_.push_back("RT throttling left on for its threads");
        return;
    }
    if (needed) {
        notes_.push_back("fair server left on for its threads");
    } else {
        lift_fair_server(settings);
    }
    throttling_lifted_ =
        try_change(settings, at("/proc/sys/kernel/sched_rt_runtime_us"), "-1", "RT throttling");
}

void Isolation::lift_fair_server(HostSettings& settings) {
    for (const int core : options_.cores) {
        const std::string fair =
            at("/sys/kernel/debug/sched/fair_server/cpu") + std::to_string(core) + "/runtime";
        if (exists(fair)) {
            try_change(settings, fair, "0", "fair server");
        } else if (exists(at("/sys/kernel/debug/sched"))) {
            continue;  // kernels before 6.12 have none
        } else {
            notes_.push_back(
                "fair server not seen (debugfs is not mounted): threads that the kernel binds to the core "
                "may have 50 ms of each second");
            break;
        }
    }
}

}  // namespace qduino::board::linux
