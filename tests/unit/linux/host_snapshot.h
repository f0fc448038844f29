// All that isolation touches on the real machine, as text: taken before and after, to be the same.
//
// What comes and goes by itself (an interrupt, a network queue, a process) is compared only where
// it is in both.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "board/linux/kernel/host_settings.h"
#include "posix/small_file.h"

namespace qduino::board::linux::test {

class HostSnapshot {
  public:
    static HostSnapshot take() {
        HostSnapshot taken;
        for (const char* path :
             {"/proc/irq/default_smp_affinity", "/sys/devices/virtual/workqueue/cpumask",
              "/proc/sys/kernel/watchdog_cpumask", "/proc/sys/vm/stat_interval",
              "/proc/sys/kernel/sched_rt_runtime_us", "/proc/sys/kernel/sched_rt_period_us",
              "/sys/fs/cgroup/cpuset/cpuset.sched_load_balance", "/sys/fs/cgroup/cgroup.subtree_control"}) {
            taken.note(path);
        }
        taken.note_each("/proc/irq", {"smp_affinity_list"});
        // v1: the sets.
        taken.note_each("/sys/fs/cgroup/cpuset", {"cpuset.cpus", "cpuset.cpu_exclusive"});
        taken.note_each("/sys/fs/cgroup", {"cpuset.cpus", "cpuset.cpus.partition"});  // v2
        taken.note_each("/sys/devices/system/cpu", {"cpufreq/scaling_governor"});
        taken.note_each("/sys/kernel/debug/sched/fair_server", {"runtime"});
        std::error_code error;
        for (const auto& card : std::filesystem::directory_iterator{"/sys/class/net", error})
            taken.note_each(card.path() / "queues", {"rps_cpus", "xps_cpus"});
        taken.note_affinities();
        return taken;
    }

    /// What is not as it was in `before`, a line each; empty: all is.
    [[nodiscard]] std::string changes_since(const HostSnapshot& before) const {
        std::string changes;
        for (const auto& [path, text] : all_) {
            const auto was = before.all_.find(path);
            if (was != before.all_.end() && was->second != text)
                changes += path + " was " + was->second + " and is " + text + "\n";
        }
        for (const auto& [path, text] : all_) {
            if (path.find("/qduino-") != std::string::npos && !before.all_.contains(path))
                changes += path + " was left behind\n";
        }
        return changes;
    }
    [[nodiscard]] std::size_t size() const { return all_.size(); }

  private:
    void note(const std::string& path) {
        const auto text = posix::read_small_file(path);
        if (text) all_[path] = text->substr(0, text->find_last_not_of('\n') + 1);
    }
    /// These files of every folder in `folder`.
    void note_each(const std::filesystem::path& folder, std::initializer_list<const char*> files) {
        std::error_code error;
        for (const auto& entry : std::filesystem::directory_iterator{folder, error}) {
            std::error_code gone;
            if (!entry.is_directory(gone)) continue;
            for (const char* file : files) note((entry.path() / file).string());
        }
    }
    /// The cores that each process may run on; by its start as well, for numbers are given again.
    /// Not those of a zombie: it keeps the cores that it died with, and nobody can move it.
    void note_affinities() {
        std::error_code error;
        for (const auto& entry : std::filesystem::directory_iterator{"/proc", error}) {
            const std::string name = entry.path().filename().string();
            if (name.find_first_not_of("0123456789") != std::string::npos) continue;
            const auto status = posix::read_small_file(entry.path().string() + "/status");
            const auto stat = posix::read_small_file(entry.path().string() + "/stat");
            if (!status || !stat) continue;
            const std::size_t line = status->find("Cpus_allowed_list:");
            if (line == std::string::npos || status->find("State:\tZ") != std::string::npos) continue;
            all_["process " + name + " started at " + start_of(*stat)] =
                status->substr(line, status->find('\n', line) - line);
        }
    }
    /// Field 22 of /proc/<pid>/stat; the second, in parentheses, may hold blanks.
    static std::string start_of(const std::string& stat) {
        std::size_t at = stat.rfind(')');
        for (int field = 2; field < 22 && at != std::string::npos; ++field) at = stat.find(' ', at + 1);
        return at == std::string::npos ? "?" : stat.substr(at + 1, stat.find(' ', at + 1) - at - 1);
    }

    std::map<std::string, std::string> all_;
};

}  // namespace qduino::board::linux::test
