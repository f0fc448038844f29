// Which of the kernel's interrupts, and which of its threads, belong to a class of devices.
//
// Two sources, joined: where sysfs ties a device to its interrupts (network, disk, serial), and otherwise the
// names that drivers give to their handlers (/sys/kernel/irq/N/actions), which is all there is for platform
// devices.
#pragma once

#include <sys/types.h>

#include <set>
#include <string>
#include <vector>

#include "base/result.h"
#include "board/linux/machine_settings.h"
#include "board/types.h"

namespace qduino::board::linux {

/// Numbers of the interrupts of `device`; `all` is every one. `root` precedes /sys and /proc (tests). Setup-time.
std::set<int> interrupts_of_class(DeviceClass device, const std::string& root = "");

/// Moves the interrupts of `device` away from `core` (allowed = false), or lets them come there as well.
/// Returns how many were changed; `stuck` counts those that the kernel would not move.
int route_class(MachineSettings& settings, DeviceClass device, int core, int cpus, bool allowed, int& stuck,
                const std::string& root = "");

/// A kernel thread that does the bottom half of a device: of a threaded interrupt, or of NAPI.
struct BottomHalf {
    pid_t tid = 0;
    std::string name;
};
/// Those of `device`, as the kernel has them now.
std::vector<BottomHalf> bottom_halves_of(DeviceClass device, const std::string& root = "");

const char* name_of(DeviceClass device);

}  // namespace qduino::board::linux
