// A folder that looks like a machine's /proc and /sys, for what changes them.
#pragma once

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

namespace qduino::board::linux::test {

class FakeMachine {
  public:
    FakeMachine() {
        static std::atomic<int> number{0};
        root_ = std::filesystem::temp_directory_path() /
                ("qduino-machine-" + std::to_string(::getpid()) + "-" + std::to_string(number++));
        std::filesystem::create_directories(root_ / "run/lock");
        for (const char* everybodys : {"dev/shm", "tmp"}) {
            std::filesystem::create_directories(root_ / everybodys);
            ::chmod((root_ / everybodys).c_str(), 01777);
        }
    }
    ~FakeMachine() { std::filesystem::remove_all(root_); }
    FakeMachine(const FakeMachine&) = delete;
    FakeMachine& operator=(const FakeMachine&) = delete;

    [[nodiscard]] std::string root() const { return root_.string(); }
    [[nodiscard]] std::string state() const { return (root_ / "run/settings.state").string(); }
    [[nodiscard]] std::string path(const std::string& file) const { return root_.string() + file; }

    void put(const std::string& file, const std::string& text) {
        std::filesystem::create_directories((root_ / file.substr(1)).parent_path());
        std::ofstream{path(file)} << text << '\n';
    }
    [[nodiscard]] std::string get(const std::string& file) const {
        std::ifstream in{path(file)};
        std::stringstream text;
        text << in.rdbuf();
        std::string all = text.str();
        while (!all.empty() && all.back() == '\n') all.pop_back();
        return all;
    }
    /// Every file and what is in it, but for the state file.
    [[nodiscard]] std::map<std::string, std::string> everything() const {
        std::map<std::string, std::string> files;
        for (const auto& entry : std::filesystem::recursive_directory_iterator{root_}) {
            const std::string name = entry.path().string().substr(root_.string().size());
            if (entry.is_regular_file() && name.rfind("/run", 0) != 0) files[name] = get(name);
        }
        return files;
    }

    /// Four CPUs, some interrupts, a network card, cpusets of the first version (with a container
    /// in one).
    void furnish() {
        put("/proc/irq/default_smp_affinity", "f");
        put("/proc/irq/10/smp_affinity_list", "0-3");
        put("/proc/irq/11/smp_affinity_list", "3");
        put("/proc/irq/12/smp_affinity_list", "0-1");
        put("/sys/class/net/eth0/queues/rx-0/rps_cpus", "f");
        put("/sys/class/net/eth0/queues/tx-0/xps_cpus", "8");
        put("/sys/devices/virtual/workqueue/cpumask", "f");
        put("/proc/sys/kernel/watchdog_cpumask", "0-3");
        put("/proc/sys/kernel/sched_rt_runtime_us", "950000");
        put("/proc/sys/vm/stat_interval", "1");
        put("/sys/devices/system/cpu/cpu3/cpufreq/scaling_governor", "schedutil");
        put("/sys/kernel/debug/sched/fair_server/cpu3/runtime", "50000000");
        put("/dev/cpu_dma_latency", "");
        const std::string sets = "/sys/fs/cgroup/cpuset";
        put(sets + "/cpuset.cpus", "0-3");
        put(sets + "/cpuset.mems", "0");
        put(sets + "/cpuset.sched_load_balance", "1");
        put(sets + "/tasks", "");
        put(sets + "/docker/cpuset.cpus", "0-3");
        // What the kernel would make with the folders.
        for (const char* group : {"/qduino-system", "/qduino-core3"}) {
            for (const char* file : {"/cpuset.cpus", "/cpuset.mems", "/cpuset.cpu_exclusive",
                                     "/cpuset.sched_load_balance", "/tasks"}) {
                put(sets + group + file, "");
            }
        }
    }

  private:
    std::filesystem::path root_;
};

}  // namespace qduino::board::linux::test
