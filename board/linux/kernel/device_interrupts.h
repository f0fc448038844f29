// The kernel's interrupts: to which cores each goes and may go, and which of them, and of the
// kernel's threads, belong to a class of devices.
//
// Two sources are joined. For network, disk and serial devices, sysfs links the device to its
// interrupts. For platform devices there is only the name that a driver gives to its handler
// (/sys/kernel/irq/N/actions).
#pragma once

#include <sys/types.h>

#include <set>
#include <string>
#include <vector>

#include "base/result.h"
#include "board/linux/kernel/cpu_list.h"
#include "board/linux/kernel/host_settings.h"
#include "board/types.h"

namespace qduino::board::linux {

/// An interrupt as /proc/irq and /sys/kernel/irq show it.
struct Interrupt {
    std::string number;
    std::string handlers;  ///< as their drivers name them; empty: none, or unknown
    bool used = true;      ///< has a handler, as far as the kernel says
    /// False: its driver keeps it where it is (a managed interrupt). Kernels before 6.10 do not
    /// tell; then it is true.
    bool movable = true;
    CpuList allowed;
    CpuList target;  ///< where it is delivered now

    /// "36 (virtio1-req.0)".
    [[nodiscard]] std::string name() const {
        return handlers.empty() ? number : number + " (" + handlers + ")";
    }
};

/// All, by number. `root` precedes /proc and /sys (tests). Setup-time.
std::vector<Interrupt> all_interrupts(const std::string& root = "");

/// Numbers of the interrupts of `device`; DeviceClass::all is every one. `root` precedes /sys and
/// /proc (tests). Setup-time.
std::set<int> interrupts_of_class(DeviceClass device, const std::string& root = "");

/// Moves the interrupts of `device` away from `core` (allowed = false), or lets them come there as
/// well. Returns how many it changed. `stuck` counts those that the kernel would not move.
int route_class(HostSettings& settings, DeviceClass device, int core, int cpus, bool allowed, int& stuck,
                const std::string& root = "");

/// A kernel thread that does the second half of a device's interrupt: a threaded interrupt, or
/// NAPI.
struct BottomHalf {
    pid_t tid = 0;
    std::string name;
};
/// Those of `device`, as the kernel has them now.
std::vector<BottomHalf> bottom_halves_of(DeviceClass device, const std::string& root = "");

std::string_view name_of(DeviceClass device);

}  // namespace qduino::board::linux
