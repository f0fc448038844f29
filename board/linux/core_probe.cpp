#include "board/linux/core_probe.h"

#include <algorithm>
#include <cstdlib>
#include <sstream>
#include <system_error>
#include <thread>

#include "board/linux/clock.h"
#include "board/linux/fatal_signals.h"
#include "board/linux/machine_settings.h"
#include "board/linux/real_time_thread.h"
#include "posix/small_file.h"

namespace qduino::board::linux {

using posix::read_small_file;

// The first line names the columns, one for each CPU that is online: "   CPU0  CPU1". Then come
// lines of "<name>: <count of each column> <words>"; the last few lines may have fewer counts.
std::optional<std::uint64_t> interrupts_of(int core, const std::string& root) {
    const auto text = read_small_file(root + "/proc/interrupts");
    if (!text) return std::nullopt;
    std::istringstream lines{*text};
    std::string line;
    std::getline(lines, line);
    std::istringstream header{line};
    int column = -1;
    std::string name;
    for (int at = 0; header >> name; ++at) {
        if (name == "CPU" + std::to_string(core)) column = at;
    }
    if (column < 0) return std::nullopt;
    std::uint64_t total = 0;
    while (std::getline(lines, line)) {
        std::istringstream words{line};
        words >> name;
        std::uint64_t count = 0;
        for (int at = 0; words >> count; ++at) {
            if (at == column) total += count;
        }
    }
    return total;
}

CpuList tickless_cores(const std::string& root) {
    return read_cpu_list(root + "/sys/devices/system/cpu/nohz_full");
}

CpuList isolated_cores(const std::string& root) {
    return read_cpu_list(root + "/sys/devices/system/cpu/isolated");
}

CoreProbe probe_core(int core, Nanoseconds duration, int priority, const std::function<void()>& enter) {
    CoreProbe probe;
    const auto spin = [&] {
        if (enter) enter();
        static_cast<void>(pin_to_core(core));
        probe.real_time = priority > 0 && become_real_time(priority).ok();
        const auto before = interrupts_of(core);
        const Instant start = monotonic_now();
        Instant last = start;
        while (last - start < duration) {
            const Instant now = monotonic_now();
            probe.worst_gap = std::max(probe.worst_gap, now - last);
            last = now;
        }
        const auto after = interrupts_of(core);
        if (before && after) {
            probe.interrupts_per_second =
                static_cast<double>(*after - *before) / to_seconds(monotonic_now() - start);
        }
    };
    const StopSignalsBlocked for_the_thread;
    try {
        std::thread{spin}.join();
    } catch (const std::system_error&) {
        probe.worst_gap = Nanoseconds{-1};  // no thread could be made: nothing was measured
    }
    return probe;
}

}  // namespace qduino::board::linux
