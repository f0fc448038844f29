// What the Linux board does to this computer for its loops, and what it says of it in the
// guarantee.
//
//   lock()   one owner for each core of the computer, whoever runs a sketch on it    (core_lock.h)
//   take()   cores in use: kept awake; owned ones emptied and probed    (isolation.h, core_probe.h)
//   serve_interrupts(), route_interrupts()     bottom halves and interrupts of a device class
//   describe()                                 what of that holds: refused is said, and why
//   give_back()                                everything as it was, where that is to be had
//
// One thread: the one that opens, starts and ends the board.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "base/result.h"
#include "board/guarantee.h"
#include "board/linux/computer/core_lock.h"
#include "board/linux/computer/core_probe.h"
#include "board/linux/computer/interference_memory.h"
#include "board/linux/computer/isolation.h"
#include "board/linux/computer/loop_promise.h"
#include "board/linux/kernel/core_times.h"
#include "board/linux/kernel/host_settings.h"
#include "board/linux/kernel/linux_config.h"
#include "board/linux/loop/vcpu_thread.h"
#include "board/linux/loop/warden_pages.h"
#include "posix/unique_fd.h"

namespace qduino::board::linux {

class CoreTaker {
  public:
    /// `config` outlives it.
    CoreTaker(const LinuxConfig& config, int core_count) : config_(config), core_count_(core_count) {}

    /// Takes the cores that loops own. Error: unavailable, another sketch has one of them: who that
    /// is.
    Result<void> lock(std::span<const VcpuSpec> specs);
    /// Notes the cores in use; isolates and probes those that a loop owns; gives bottom halves to
    /// their VCPUs.
    void take(std::span<const VcpuSpec> specs);
    /// The isolation of the core that `spec` is to enter; null: the core is not isolated.
    [[nodiscard]] const Isolation* isolation_of(const VcpuSpec& spec) const {
        return isolation_.owns(spec.core) ? &isolation_ : nullptr;
    }
    /// What could not be undone stays in the state file, for `qduino restore`. What the run has
    /// seen of interrupts is remembered.
    void give_back();

    // As LinuxBoard has them:
    void serve_interrupts(DeviceClass device, VcpuId io);
    /// The I/O VCPU that serves `device`; kNoVcpu: none.
    [[nodiscard]] VcpuId server_of(DeviceClass device) const {
        return served_by_[static_cast<std::size_t>(device)];
    }
    Result<void> route_interrupts(DeviceClass device, int core, bool allowed);
    [[nodiscard]] Result<void> core_timer(int core, bool enabled) const;

    /// The kernel threads that work on the budget of an I/O VCPU, and are to have its rank. Known
    /// after take(), which has recorded what they have, and bound them to its core.
    [[nodiscard]] std::span<const KernelThread> kernel_threads() const { return kernel_threads_; }

    /// What interrupts take of `core`. The first call takes looks at it: 0.75 s when little is
    /// remembered (interference_memory.h), else 0.15 s, and none beside the loops of another
    /// sketch, which the spin would delay. Not measured where probes are turned off. Setup-time.
    const Interference& interference(int core);
    /// What other programs have been promised on `core`, as of the first call. Setup-time.
    const Neighbours& neighbours(int core);

    /// What holds for the loop of `thread`, and what does not.
    [[nodiscard]] LoopGuarantee describe(const VcpuThread& thread) const;
    /// What holds on the cores in use.
    void describe_cores(GuaranteeReport& report) const;

  private:
    /// A core that VCPUs run on.
    struct UsedCore {
        int core = 0;
        bool owned = false;
        std::optional<CoreProbe> probe;  // of an owned core, before its loop began
        std::optional<InterruptCounts> interrupts_at_start;
    };
    /// What interrupts take of a core, as admission was told.
    struct KnownCore {
        InterferenceMemory memory;
        Interference told;
        bool said = false;     // by QDUINO_INTERRUPTS
        bool refused = false;  // what that says is malformed
    };

    Result<void> open_settings();
    void isolate(std::span<const VcpuSpec> specs);
    void probe_owned_cores();
    void take_bottom_halves(std::span<const VcpuSpec> specs);
    void take_kernel_threads(DeviceClass device, const VcpuSpec& io, int priority);
    [[nodiscard]] CoreGuarantee describe(const UsedCore& used) const;
    void compare_with_admission(const UsedCore& used, std::optional<InterruptCounts> now,
                                CoreGuarantee& report) const;
    void remember_run();

    const LinuxConfig& config_;
    int core_count_;
    std::vector<CoreLock> core_locks_;  // before the settings: given up after they are undone
    FixedString<200> lock_shortfall_;
    HostSettings settings_;  // open once something was changed; undoes it
    Isolation isolation_;
    posix::UniqueFd awake_;  // keep_cores_awake()
    FixedString<200> isolation_shortfall_;
    std::vector<UsedCore> cores_;
    // By core, as far as admission asked.
    std::map<int, KnownCore> known_;
    std::map<int, Neighbours> neighbours_;
    Instant started_at_{};
    std::array<VcpuId, kDeviceClassCount> served_by_{};
    std::array<FixedString<160>, kDeviceClassCount> served_note_;
    FixedVector<KernelThread, kKernelThreadsMax> kernel_threads_;
};

}  // namespace qduino::board::linux
