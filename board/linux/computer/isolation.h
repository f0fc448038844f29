// Takes a core for one loop: moves everything else that can be moved off it, and puts it back at
// the end.
//
//   order                                    why in this order
//   1. cpusets      tasks off the core         the loop's thread enters its own set
//   2. interrupts   IRQs, their default        leaves the tick, and what is bound to the core
//      RPS, XPS     network softirqs
//      workqueues, watchdog, vmstat            kernel threads that would come back
//   3. governor                                no slow clock
//   4. RT throttling, fair server              last: with 1 done, no task is left to starve there;
//                                              kept if 2 left an interrupt behind (lift_throttling)
//
// The changes are undone in the opposite order (host_settings.h). What the computer does not
// have or refuses is a note, not a failure.
//
// There are two generations of cpusets. v1: everything in the root set moves to `qduino-system`
// (all other cores). The core gets an exclusive set of its own, `qduino-core<N>`, and the root
// stops balancing over both. v2: a threaded child of the root becomes an isolated partition; that
// alone takes the core from all others.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "base/fixed_string.h"
#include "base/result.h"
#include "base/time.h"
#include "board/linux/kernel/cpu_list.h"
#include "board/linux/kernel/host_settings.h"

namespace qduino::board::linux {

struct IsolationOptions {
    std::vector<int> cores;  ///< to be owned
    int cpus = 1;            ///< of the computer
    bool lift_throttling = true;
    std::string root;  ///< precedes /proc, /sys and /dev (tests)
};

class Isolation {
  public:
    Isolation() = default;  ///< owns nothing

    /// Makes the changes, through `settings`, which undoes them. Setup-time. Error: out_of_range
    /// (no core would be left for the rest).
    static Result<Isolation> begin(HostSettings& settings, const IsolationOptions& options);

    /// Puts the thread `tid` of this process into the owned core's set. The thread must pin itself
    /// afterwards.
    Result<void> adopt(int core, pid_t tid) const;

    [[nodiscard]] bool owns(int core) const { return owned_.has(core); }
    /// No task of another process can run on the owned cores.
    [[nodiscard]] bool exclusive() const { return cpusets_ != Cpusets::none; }
    [[nodiscard]] bool throttling_lifted() const { return throttling_lifted_; }
    /// What could not be done, each with the reason.
    [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }

  private:
    enum class Cpusets { none, v1, v2 };

    [[nodiscard]] std::optional<CpuList> left_of(const CpuList& cpus) const;
    void take_cores_v1(HostSettings& settings);
    Result<void> make_sets_v1(HostSettings& settings, const std::string& system,
                              std::string_view nodes) const;
    void take_cores_v2(HostSettings& settings);
    void shrink_other_sets_v1(HostSettings& settings, const std::string& top);
    void move_interrupts(HostSettings& settings);
    void move_network(HostSettings& settings);
    void move_kernel_work(HostSettings& settings);
    void stay_fast(HostSettings& settings);
    void lift_throttling(HostSettings& settings);
    void lift_fair_server(HostSettings& settings);
    void note_kept_interrupts();
    bool try_change(HostSettings& settings, const std::string& path, std::string_view text,
                    std::string_view what);
    [[nodiscard]] std::string at(std::string_view path) const { return options_.root + std::string{path}; }

    IsolationOptions options_;
    CpuList owned_;
    CpuList rest_;
    Cpusets cpusets_ = Cpusets::none;
    bool throttling_lifted_ = false;
    std::vector<std::string> kept_interrupts_;  // by name: those that stay on an owned core
    std::vector<std::string> notes_;
};

}  // namespace qduino::board::linux
