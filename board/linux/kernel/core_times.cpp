#include "board/linux/kernel/core_times.h"

#include <unistd.h>

#include <algorithm>
#include <string_view>
#include <vector>

#include "base/whole_number.h"
#include "board/linux/kernel/kernel_text.h"

namespace qduino::board::linux {
namespace {

/// Local timer interrupts, as the kernel names them in /proc/interrupts.
constexpr std::string_view kTimerOfX86 = "LOC", kTimerOfArm = "arch_timer";

// The first line names the columns, one for each CPU that is online: "   CPU0  CPU1". Then come
// lines of "<name>: <count of each column> <words>"; the last word of a device's is its driver's.
// The last few lines may have fewer counts.
std::map<std::string, std::uint64_t> interrupt_counts(int core, const std::string& root) {
    std::map<std::string, std::uint64_t> counts;
    const std::string text = text_of_file(root + "/proc/interrupts");
    std::string_view lines = text;
    const auto columns = words(cut(lines, '\n'));
    const auto ours = std::ranges::find(columns, "CPU" + std::to_string(core));
    if (ours == columns.end()) return counts;
    const auto column = static_cast<std::size_t>(ours - columns.begin()) + 1;  // behind the name
    while (!lines.empty()) {
        const auto line = words(cut(lines, '\n'));
        if (column >= line.size()) continue;
        const bool of_a_device = whole_number<int>(line[0].substr(0, line[0].find(':'))).has_value();
        const std::string_view name = of_a_device ? line.back() : line[0].substr(0, line[0].find(':'));
        counts[std::string{name}] += whole_number<std::uint64_t>(line[column]).value_or(0);
    }
    return counts;
}

// "cpu1 user nice system idle iowait irq softirq steal …", in ticks of USER_HZ (proc_stat(5)).
void add_ticks(CoreTimes& times, int core, const std::string& root) {
    constexpr std::size_t kIrq = 6, kSoftIrq = 7, kSteal = 8;
    const std::string text = text_of_file(root + "/proc/stat");
    for (std::string_view lines = text; !lines.empty();) {
        const auto fields = words(cut(lines, '\n'));
        if (fields.size() <= kSteal || fields[0] != "cpu" + std::to_string(core)) continue;
        const auto time = [&](std::size_t field) -> std::optional<Nanoseconds> {
            const auto ticks = whole_number<std::int64_t>(fields[field]);
            if (!ticks) return std::nullopt;
            return Nanoseconds{*ticks * (1'000'000'000 / ::sysconf(_SC_CLK_TCK))};
        };
        times.host = time(kSteal);
        if (const auto hard = time(kIrq), soft = time(kSoftIrq); hard && soft)
            times.interrupted = *hard + *soft;
        return;
    }
}

}  // namespace

CoreTimes core_times(int core, const std::string& root) {
    CoreTimes times;
    add_ticks(times, core, root);
    times.interrupts = interrupt_counts(core, root);
    return times;
}

std::optional<InterruptCounts> interrupt_counts_of(int core, const std::string& root) {
    const auto counts = interrupt_counts(core, root);
    if (counts.empty()) return std::nullopt;
    InterruptCounts found;
    for (const auto& [name, count] : counts)
        (name == kTimerOfX86 || name == kTimerOfArm ? found.ticks : found.others) += count;
    return found;
}

std::optional<std::uint64_t> interrupts_of(int core, const std::string& root) {
    const auto counts = interrupt_counts_of(core, root);
    if (!counts) return std::nullopt;
    return counts->all();
}

}  // namespace qduino::board::linux
