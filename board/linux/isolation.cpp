#include "board/linux/isolation.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <set>

#include "board/linux/device_interrupts.h"
#include "board/linux/kernel_release.h"
#include "posix/small_file.h"
#include "posix/system_error.h"

namespace qduino::board::linux {

using posix::read_small_file;
using posix::write_small_file;
namespace {

namespace fs = std::filesystem;

bool exists(const std::string& path) { return ::access(path.c_str(), F_OK) == 0; }

/// The entries of a folder, in order of name; none when it is not there.
std::vector<std::string> entries(const std::string& folder) {
    std::vector<std::string> names;
    std::error_code error;
    for (fs::directory_iterator at{folder, error}, end; !error && at != end; at.increment(error)) {
        names.push_back(at->path().filename().string());
    }
    std::sort(names.begin(), names.end());
    return names;
}

bool has_word(std::string_view text, std::string_view word) {
    const std::size_t found = text.find(word);
    return found != std::string_view::npos;
}

/// Calls `visit` with each task of a v1 set.
template <typename Visit>
void for_each_task(const std::string& set, Visit visit) {
    const auto tasks = read_small_file(set + "/tasks");
    for (std::string_view rest = tasks ? std::string_view{*tasks} : ""; !rest.empty();) {
        const std::size_t end = rest.find('\n');
        if (end != 0) visit(std::string{rest.substr(0, end)});
        rest = end == std::string_view::npos ? std::string_view{} : rest.substr(end + 1);
    }
}

/// Moves the tasks of one v1 set to another, until a look finds none that is new. Kernel threads
/// that are bound to a core refuse to move.
void move_all_tasks(const std::string& from, const std::string& to) {
    std::set<std::string, std::less<>> tried;
    for (bool found_new = true; found_new;) {
        found_new = false;
        for_each_task(from, [&](const std::string& task) {
            if (!tried.insert(task).second) return;
            found_new = true;
            static_cast<void>(write_small_file(to + "/tasks", task));
        });
    }
}

}  // namespace

Result<Isolation> Isolation::begin(MachineSettings& settings, const IsolationOptions& options) {
    Isolation isolation;
    isolation.options_ = options;
    for (const int core : options.cores) isolation.owned_.add(core);
    isolation.rest_ = CpuList::first(options.cpus).without(isolation.owned_);
    if (isolation.rest_.empty()) {
        return make_error(ErrorCode::out_of_range,
                          "no core would be left for the rest of the machine: let loops own fewer cores");
    }

    const std::string v1 = isolation.at("/sys/fs/cgroup/cpuset");
    const auto controllers = read_small_file(isolation.at("/sys/fs/cgroup/cgroup.controllers"));
    if (exists(v1 + "/cpuset.cpus")) {
        isolation.take_cores_v1(settings);
    } else if (controllers && has_word(*controllers, "cpuset")) {
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

bool Isolation::try_change(MachineSettings& settings, const std::string& path, std::string_view text,
                           std::string_view what) {
    const auto changed = settings.change(path, text);
    if (!changed) notes_.push_back(std::string{what} + ": " + std::string{changed.error().message.view()});
    return changed.ok();
}

// ---- 1. tasks -----------------------------------------------------------------------------------

/// Takes our cores out of every child set of the root: the sets of cores must not overlap.
void Isolation::shrink_other_sets_v1(MachineSettings& settings, const std::string& top) {
    for (const std::string& name : entries(top)) {
        const std::string cpus = top + "/" + name + "/cpuset.cpus";
        if (name.rfind("qduino-", 0) == 0 || !exists(cpus)) continue;
        const CpuList list = read_cpu_list(cpus);
        const CpuList left = list.without(owned_);
        if (left == list) continue;
        // Children first: a child is never larger than its parent.
        shrink_other_sets_v1(settings, top + "/" + name);
        try_change(settings, cpus, (left.empty() ? rest_ : left).to_list(), "cpuset " + name);
    }
}

void Isolation::take_cores_v1(MachineSettings& settings) {
    const std::string top = at("/sys/fs/cgroup/cpuset");
    const auto memory = read_small_file(top + "/cpuset.mems");
    const std::string nodes = memory ? memory->substr(0, memory->find('\n')) : "0";
    // First, so that it is undone last, when the tasks are back in the root set.
    for_each_task(top, [&](const std::string& task) {
        static_cast<void>(
            settings.remember_affinity(static_cast<pid_t>(std::strtol(task.c_str(), nullptr, 10))));
    });
    shrink_other_sets_v1(settings, top);

    const std::string system = top + "/qduino-system";
    bool done = settings.make_group(system).ok() &&
                write_small_file(system + "/cpuset.cpus", rest_.to_list()).ok() &&
                write_small_file(system + "/cpuset.mems", nodes).ok();
    for (const int core : options_.cores) {
        const std::string own = top + "/qduino-core" + std::to_string(core);
        done = done && settings.make_group(own).ok() &&
               write_small_file(own + "/cpuset.cpus", std::to_string(core)).ok() &&
               write_small_file(own + "/cpuset.mems", nodes).ok() &&
               write_small_file(own + "/cpuset.cpu_exclusive", "1").ok() &&
               write_small_file(own + "/cpuset.sched_load_balance", "0").ok();
    }
    if (!done) {
        notes_.push_back("cpusets: cannot make exclusive sets under " + top);
        return;
    }
    move_all_tasks(top, system);
    // The root no longer balances load over all cores; `qduino-system` does so over the rest.
    try_change(settings, top + "/cpuset.sched_load_balance", "0", "load balancing");
    cpusets_ = Cpusets::v1;
}

void Isolation::take_cores_v2(MachineSettings& settings) {
    const std::string top = at("/sys/fs/cgroup");
    const auto enabled = read_small_file(top + "/cgroup.subtree_control");
    if (!enabled || !has_word(*enabled, "cpuset")) {
        // Stays enabled afterwards: it changes nothing by itself, and other programs may have come
        // to rely on it.
        if (!write_small_file(top + "/cgroup.subtree_control", "+cpuset").ok()) {
            notes_.push_back("cpusets: cannot enable the cpuset controller in " + top);
            return;
        }
    }
    for (const int core : options_.cores) {
        const std::string own = top + "/qduino-core" + std::to_string(core);
        const bool made = settings.make_group(own).ok() &&
                          write_small_file(own + "/cgroup.type", "threaded").ok() &&
                          write_small_file(own + "/cpuset.cpus", std::to_string(core)).ok() &&
                          write_small_file(own + "/cpuset.cpus.partition", "isolated").ok();
        const auto state = read_small_file(own + "/cpuset.cpus.partition");
        if (!made || !state || has_word(*state, "invalid")) {
            notes_.push_back("cpusets: the kernel gives no isolated partition for core " +
                             std::to_string(core));
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
    if (auto moved = write_small_file(top + "/cgroup.procs", std::to_string(::getpid())); !moved)
        return moved;
    return write_small_file(top + name + "/cgroup.threads", thread);
}

// ---- 2. interrupts and kernel work --------------------------------------------------------------

void Isolation::move_interrupts(MachineSettings& settings) {
    try_change(settings, at("/proc/irq/default_smp_affinity"), rest_.to_mask(options_.cpus),
               "default interrupt affinity");
    for (const Interrupt& irq : all_interrupts(options_.root)) {
        const CpuList left = irq.allowed.without(owned_);
        if (left == irq.allowed) continue;
        const std::string path = at("/proc/irq/") + irq.number + "/smp_affinity_list";
        if (irq.movable && settings.change(path, (left.empty() ? rest_ : left).to_list())) continue;
        if (irq.used && irq.target.without(owned_) != irq.target) kept_interrupts_.push_back(irq.name());
    }
    if (!kept_interrupts_.empty()) note_kept_interrupts();
}

void Isolation::note_kept_interrupts() {
    const bool one = kept_interrupts_.size() == 1;
    std::string note = one ? "interrupt " : "interrupts ";
    for (std::size_t i = 0; i < kept_interrupts_.size(); ++i)
        note += (i == 0 ? "" : ", ") + kept_interrupts_[i];
    notes_.push_back(note + (one ? " stays" : " stay") + " on the core: to let the kernel place " +
                     (one ? "it" : "them") + " elsewhere, boot with isolcpus=managed_irq," +
                     owned_.to_list());
}

void Isolation::move_network(MachineSettings& settings) {
    const std::string devices = at("/sys/class/net");
    for (const std::string& device : entries(devices)) {
        const std::string queues = devices + "/" + device + "/queues";
        for (const std::string& queue : entries(queues)) {
            for (const char* file : {"/rps_cpus", "/xps_cpus"}) {
                const std::string path = queues + "/" + queue + file;
                const auto text = read_small_file(path);
                const auto cpus = text ? CpuList::from_mask(*text) : std::nullopt;
                if (!cpus || cpus->without(owned_) == *cpus) continue;
                const CpuList left = cpus->without(owned_);
                try_change(settings, path, (left.empty() ? rest_ : left).to_mask(options_.cpus),
                           "network queue " + queue);
            }
        }
    }
}

void Isolation::move_kernel_work(MachineSettings& settings) {
    const std::string mask = rest_.to_mask(options_.cpus);
    try_change(settings, at("/sys/devices/virtual/workqueue/cpumask"), mask, "unbound workqueues");
    const std::string watchdog = at("/proc/sys/kernel/watchdog_cpumask");
    if (exists(watchdog)) try_change(settings, watchdog, rest_.to_list(), "watchdog");
    const std::string vmstat = at("/proc/sys/vm/stat_interval");
    // vmstat's work on each core comes every 2 min instead of every second.
    if (exists(vmstat)) try_change(settings, vmstat, "120", "vmstat");
}

// ---- 3. and 4. ----------------------------------------------------------------------------------

void Isolation::stay_fast(MachineSettings& settings) {
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
void Isolation::lift_throttling(MachineSettings& settings) {
    const bool needed = !kept_interrupts_.empty();
    const auto release = read_small_file(at("/proc/sys/kernel/osrelease"));
    if (needed && !(release && release_at_least(*release, 6, 12))) {
        notes_.push_back("RT throttling left on, for the threads that finish what that begins");
        return;
    }
    if (needed) {
        notes_.push_back("fair server left on, for the threads that finish what that begins");
    } else {
        lift_fair_server(settings);
    }
    throttling_lifted_ =
        try_change(settings, at("/proc/sys/kernel/sched_rt_runtime_us"), "-1", "RT throttling");
}

void Isolation::lift_fair_server(MachineSettings& settings) {
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
