#include "board/linux/core_probe.h"

#include <algorithm>
#include <system_error>
#include <thread>

#include "base/whole_number.h"
#include "board/linux/clock.h"
#include "board/linux/fatal_signals.h"
#include "board/linux/host_settings.h"
#include "board/linux/kernel_text.h"
#include "board/linux/real_time_thread.h"

namespace qduino::board::linux {

// The first line names the columns, one for each CPU that is online: "   CPU0  CPU1". Then come
// lines of "<name>: <count of each column> <words>"; the last few lines may have fewer counts.
std::optional<std::uint64_t> interrupts_of(int core, const std::string& root) {
    const std::string text = text_of_file(root + "/proc/interrupts");
    std::string_view lines = text;
    const auto columns = words(cut(lines, '\n'));
    const auto ours = std::ranges::find(columns, "CPU" + std::to_string(core));
    if (ours == columns.end()) return std::nullopt;
    const auto column = static_cast<std::size_t>(ours - columns.begin()) + 1;  // behind the name
    std::uint64_t total = 0;
    while (!lines.empty()) {
        const auto counts = words(cut(lines, '\n'));
        if (column < counts.size()) total += whole_number<std::uint64_t>(counts[column]).value_or(0);
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
