// A control group that the kernel holds to a budget of CPU time: whatever its processes fork, and
// whether they work with the keeper or not (Turner, Rao, Rao, "CPU bandwidth control for CFS",
// Linux Symposium 2010; Documentation/scheduler/sched-bwc.rst and
// Documentation/admin-guide/cgroup-v2.rst in the kernel's tree).
//
//               cgroup v2                           cgroup v1
//   budget      cpu.max  "10000 100000"             cpu.cfs_quota_us, cpu.cfs_period_us
//   weight      cpu.weight                          cpu.shares
//   use         cpu.stat                            cpu.stat, cpuacct.usage (a second folder where
//                                                   cpuacct is a hierarchy of its own)
//
// The weight is the highest: what the budget allows, the group gets before ordinary tasks. The
// budget counts on all cores together; the core itself is kept by affinity (enter()).
//
// Where the group is made: as high as this user may. That is the top for root, and the slice that
// systemd has given to the user otherwise. The processes that hold a group, and what happens to it
// after their death: core_promises.h.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

#include "base/result.h"
#include "base/time.h"

namespace qduino::board::linux {

/// What a group has used since it was made, as the kernel counts it.
struct CpuGroupUse {
    Nanoseconds used{};           ///< CPU time of all its processes, ended ones too
    std::int64_t periods = 0;     ///< in which the group wanted to run
    std::int64_t throttled = 0;   ///< of them, those in which the budget was spent
    Nanoseconds throttled_for{};  ///< how long its threads were kept waiting, in sum
};

/// Where a group can be made: found before anything is changed.
struct CpuGroupPlace {
    bool second_version = false;       ///< cgroup v2
    std::vector<std::string> parents;  ///< folders of the parent groups, that of `cpu` first
};

/// Finds the place. Error: unsupported (no hierarchy has the cpu controller), not_permitted (none
/// can be written): the text says what to do. `root` precedes /proc and what it names (tests).
[[nodiscard]] Result<CpuGroupPlace> find_cpu_group_place(const std::string& root = "");

/// Is the kernel able to keep this budget? Error: invalid_argument, with the nearest that it is.
[[nodiscard]] Result<void> check_cpu_group_budget(Nanoseconds budget, Nanoseconds period);

class CpuGroup {
  public:
    /// Stands for the group `name` in `place`; makes nothing yet.
    CpuGroup(const CpuGroupPlace& place, const std::string& name);

    /// Makes the folders and sets the budget. Set-up time. Error: what the kernel says; nothing is
    /// left behind then.
    [[nodiscard]] Result<void> make(Nanoseconds budget, Nanoseconds period);
    /// Gives it another budget, from the next period on. Error: what the kernel says.
    [[nodiscard]] Result<void> set_budget(Nanoseconds budget, Nanoseconds period) const;
    /// Puts the calling process into it, with all its children to come: an ordinary task, bound to
    /// `core`, that can no longer become real-time by itself. Between fork(2) and exec(2) of a
    /// program with one thread. Error: what the kernel says.
    [[nodiscard]] Result<void> enter(int core) const;
    /// Error: not_found after it was removed.
    [[nodiscard]] Result<CpuGroupUse> use() const;
    [[nodiscard]] bool second_version() const { return second_version_; }
    /// The folders, that of `cpu` first.
    [[nodiscard]] const std::vector<std::string>& folders() const { return folders_; }

  private:
    bool second_version_ = false;
    std::vector<std::string> folders_;
};

/// The processes in the group with this folder; none when it is not there.
[[nodiscard]] std::vector<pid_t> members_of_group(const std::string& folder);
/// Sends `signal` to all of them.
void signal_group(const std::string& folder, int signal);
/// Kills what is left in the group, and removes its folders. Waits up to `patience` for the dying.
/// False: something of it is still there. Refuses folders that CpuGroup has not named.
bool remove_group(const std::vector<std::string>& folders, Nanoseconds patience);

}  // namespace qduino::board::linux
