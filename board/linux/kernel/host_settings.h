// Changes to the computer that can always be undone: each is written into a state file before it is
// made.
//
//   state file (on /run, gone with the boot)          undone, from the last line to the first
//   ───────────────────────────────────────────
//   qduino-settings 1 <boot id>
//   write <TAB> /proc/irq/36/smp_affinity <TAB> 3      write 3 back
//   affinity <TAB> 412 <TAB> 88231 <TAB> 0             pin thread 412 to core 0 again, if it is the
//                                                      one that started at 88231
//   policy <TAB> 50 <TAB> 211 <TAB> 1 <TAB> 50         thread 50 had policy 1 (FIFO), priority 50
//   group <TAB> /sys/fs/cgroup/cpuset/qduino-core1     move its tasks to the parent, remove it
//
// A process that changes settings holds a lock on the file; the lock ends with the process, however
// that dies. So a dead process left a state file that is not empty and not locked: the supervisor,
// `qduino restore` or the next start undoes it.
//
// Invariant: every change is in the file, at every instant. (A line in the file may not have been
// carried out yet. To undo it then writes the value that it has anyway.)
#pragma once

#include <sys/types.h>

#include <string>
#include <string_view>

#include "base/result.h"
#include "board/linux/kernel/cpu_list.h"
#include "posix/unique_fd.h"

namespace qduino::board::linux {

inline constexpr const char* kDefaultSettingsState = "/run/qduino/settings.state";

/// A file with a list of CPUs; the empty list when it cannot be read or is none ("(null)").
CpuList read_cpu_list(const std::string& path);

class HostSettings {
  public:
    HostSettings() = default;
    HostSettings(HostSettings&&) = default;
    HostSettings& operator=(HostSettings&&) = default;
    /// Undoes every change.
    ~HostSettings();

    /// Takes the state file at `path` (made with its folder when missing), after undoing what a
    /// dead process left in it. Errors: unavailable (a living process has changed settings),
    /// not_permitted.
    static Result<HostSettings> open(std::string path);

    /// Writes `text` to the setting at `path`, its present value recorded first. A setting that has
    /// the value already is left alone. Error: not_found, or what the kernel says; the computer is
    /// then as before.
    Result<void> change(const std::string& path, std::string_view text);
    /// Makes a cgroup, recorded first. Undoing moves its tasks out and removes it.
    Result<void> make_group(const std::string& path);

    /// Records the cores to which the thread `tid` is bound, if it is bound and can be. Kernels
    /// before 6.2 forget that when the thread moves between cpusets.
    Result<void> remember_affinity(pid_t tid);

    /// Binds the kernel thread `tid` to `core`, after recording its cores, its policy and its
    /// priority: from now on these may be changed. Error: not_permitted (CAP_SYS_NICE), not_found
    /// (it has ended).
    Result<void> take_thread(pid_t tid, int core);

    /// Undoes everything now. The first change that cannot be undone is the error, and stays in the
    /// file.
    Result<void> undo();
    [[nodiscard]] bool active() const { return file_.valid(); }

  private:
    template <typename... Pieces>
    Result<void> record(const Pieces&... pieces);
    Result<void> record_affinity(pid_t tid, const CpuList& cpus);

    std::string path_;
    posix::UniqueFd file_;
};

/// What restore_settings() found.
enum class Restored { nothing_to_do, undone };

/// Undoes what a dead process left in the state file at `path`: for the supervisor and `qduino
/// restore`. Errors: unavailable (its process lives: stop that instead), or the first change that
/// could not be undone.
Result<Restored> restore_settings(const std::string& path);

}  // namespace qduino::board::linux
