// What is below and beside the kernel: a host, memory management, the leftovers of a dead run.
#include <fcntl.h>
#include <sys/file.h>

#include <algorithm>
#include <chrono>
#include <sstream>
#include <thread>

#include "board/linux/kernel/host_settings.h"
#include "doctor/finding.h"
#include "posix/unique_fd.h"

namespace qduino::apps::doctor {
namespace {

constexpr std::chrono::milliseconds kWatch{300};

bool is_virtual(const Facts& facts) {
    const auto processors = facts.text("/proc/cpuinfo");
    const std::size_t flags = processors ? processors->find("flags") : std::string::npos;
    if (flags == std::string::npos) {  // processors that do not tell
        const std::string model = facts.model();
        return facts.exists("/sys/hypervisor/type") || model.find("QEMU") != std::string::npos ||
               model.find("KVM") != std::string::npos || model == "linux,dummy-virt";
    }

    const std::string line = processors->substr(flags, processors->find('\n', flags) - flags) + ' ';
    return line.find(" hypervisor ") != std::string::npos;
}

Finding hypervisor(const Facts& facts) {
    if (!is_virtual(facts)) return ok("none: this is the computer itself");
    return better("a virtual machine",
                  "run on the board itself; or, on the host, give each virtual processor a core of its own: "
                  "virsh vcpupin NAME 1 CORE");
}

Finding steal(const Facts& facts) {
    const auto before = facts.text("/proc/stat");
    if (!before) return ok("not seen: not judged");
    if (is_virtual(facts)) std::this_thread::sleep_for(kWatch);
    const double share = stolen_percent(*before, facts.text("/proc/stat").value_or(""));
    const std::string found = text<std::string>(Fixed{share, 1}, " % of the time in ", kWatch.count(), " ms");
    if (!is_virtual(facts)) return ok("nobody to take time from it");
    if (share < 0.1) return ok(found);
    return better(found,
                  "on the host: run fewer virtual machines beside this one, or virsh vcpupin NAME 1 CORE");
}

Finding huge_pages(const Facts& facts) {
    const std::string path = "/sys/kernel/mm/transparent_hugepage/enabled";
    const auto setting = facts.text(path);
    if (!setting) return ok("the kernel has none");
    if (setting->find("[always]") == std::string::npos) return ok(*setting);
    return better(*setting, "echo madvise | sudo tee " + path);
}

Finding swap(const Facts& facts) {
    std::istringstream lines{facts.text("/proc/swaps").value_or("")};
    std::vector<std::string> areas;
    std::string line;
    std::getline(lines, line);  // the heading
    while (std::getline(lines, line)) areas.push_back(line.substr(0, line.find_first_of(" \t")));
    if (areas.empty()) return ok("none");
    return better(some_of(areas, 3), "sudo swapoff -a && sudo systemctl mask swap.target");
}

/// The file is locked as long as the run lives whose changes are in it (host_settings.h).
Finding leftovers(const Facts& facts) {
    const std::string path = facts.at(board::linux::kDefaultSettingsState);
    const posix::UniqueFd file{::open(path.c_str(), O_RDONLY | O_CLOEXEC)};
    const auto text = facts.text(board::linux::kDefaultSettingsState);
    if (!text && facts.exists(board::linux::kDefaultSettingsState))
        return ok(path + " is root's: not judged");
    // The first line is a heading.
    const auto changes = text ? std::count(text->begin(), text->end(), '\n') : 0;
    if (!file.valid() || changes == 0) return ok("nothing is left of an earlier run");
    if (::flock(file.get(), LOCK_SH | LOCK_NB) != 0) return ok("a sketch runs and has changed settings");
    return better(std::to_string(changes) + " changes of a run that died", "sudo qduino restore");
}

constexpr std::array kHostChecks{
    Check{"hypervisor", "a host may stop a core at any time, and no setting in here keeps it from that",
          hypervisor},
    Check{"steal", "time that the host gives to others is missing from every budget", steal},
    Check{"huge_pages", "the kernel collects and splits huge pages while loops run", huge_pages},
    Check{"swap", "what is not locked waits for the disk when it is used again", swap},
    Check{"leftovers", "cores, interrupts and throttling are still as that run had set them", leftovers},
};

/// The line "cpu …": user nice system idle iowait irq softirq steal guest guest_nice (proc(5)).
std::vector<long long> counts_of(std::string_view stat) {
    std::vector<long long> counts;
    std::istringstream words{std::string{stat.substr(0, stat.find('\n'))}};
    std::string name;
    words >> name;
    for (long long count = 0; words >> count;) counts.push_back(count);
    return counts;
}

}  // namespace

double stolen_percent(std::string_view before, std::string_view after) {
    constexpr std::size_t kSteal = 7;
    constexpr std::size_t kCounted = 8;  // guest time is in user time already
    const std::vector<long long> first = counts_of(before);
    const std::vector<long long> last = counts_of(after);
    if (first.size() < kCounted || last.size() < kCounted) return 0;
    long long passed = 0;
    for (std::size_t i = 0; i < kCounted; ++i) passed += last[i] - first[i];
    if (passed <= 0) return 0;
    return 100.0 * static_cast<double>(last[kSteal] - first[kSteal]) / static_cast<double>(passed);
}

std::span<const Check> host_checks() { return kHostChecks; }

}  // namespace qduino::apps::doctor
