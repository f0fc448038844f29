#include "board/linux/computer/core_probe.h"

#include <algorithm>

#include "board/linux/kernel/bare_spin.h"
#include "board/linux/kernel/host_settings.h"
#include "board/linux/kernel/kernel_text.h"
#include "board/linux/kernel/real_time_thread.h"

namespace qduino::board::linux {

CpuList tickless_cores(const std::string& root) {
    return read_cpu_list(root + "/sys/devices/system/cpu/nohz_full");
}

CpuList isolated_cores(const std::string& root) {
    return read_cpu_list(root + "/sys/devices/system/cpu/isolated");
}

CoreProbe probe_core(int core, Nanoseconds duration, int priority, const std::function<void()>& enter) {
    CoreProbe probe;
    const bool ran = run_apart([&] {
        if (enter) enter();
        static_cast<void>(pin_to_core(core));
        probe.real_time = priority > 0 && become_real_time(priority).ok();
        const auto look = [&probe](Nanoseconds between) {
            probe.worst_gap = std::max(probe.worst_gap, between);
        };
        probe.interrupts_per_second = spin_and_count(core, duration, look).value_or(-1);
    });
    if (!ran) probe.worst_gap = Nanoseconds{-1};
    return probe;
}

}  // namespace qduino::board::linux
