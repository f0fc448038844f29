// Which interrupts reach the core that a loop would own, and who moves them about.
#include <sys/stat.h>

#include <array>
#include <sstream>

#include "apps/doctor/finding.h"

namespace qduino::apps::doctor {
namespace {

using board::linux::CpuList;

/// "36 (virtio1-req.0)": the number, and the handlers as /sys names them.
std::string name_of(const Facts& facts, const std::string& irq) {
    const auto handlers = facts.text("/sys/kernel/irq/" + irq + "/actions");
    return handlers && !handlers->empty() ? irq + " (" + *handlers + ")" : irq;
}

/// The kernel lets it be moved: since Linux 6.10 the file's mode says so, before it all look movable.
bool is_movable(const Facts& facts, const std::string& irq) {
    struct stat entry {};
    const std::string path = facts.at("/proc/irq/" + irq + "/smp_affinity_list");
    return ::stat(path.c_str(), &entry) == 0 && (entry.st_mode & S_IWUSR) != 0;
}

/// Whether somebody handles it. Idle lines are no trouble.
bool is_used(const Facts& facts, const std::string& irq) {
    const auto handlers = facts.text("/sys/kernel/irq/" + irq + "/actions");
    return !handlers || !handlers->empty();  // without /sys/kernel/irq: cannot tell
}

Finding interrupt_affinity(const Facts& facts) {
    if (facts.core_count() < 2) return {State::ok, "one core only: nothing can be moved", ""};
    const int core = facts.owned_core();
    std::vector<std::string> here;
    std::size_t bound = 0;
    for (const std::string& irq : facts.entries("/proc/irq")) {
        const std::string folder = "/proc/irq/" + irq;
        CpuList target = facts.cpus(folder + "/effective_affinity_list");
        if (target.empty()) target = facts.cpus(folder + "/smp_affinity_list");
        if (!target.has(core) || !is_used(facts, irq)) continue;
        if (is_movable(facts, irq)) {
            here.push_back(name_of(facts, irq));
        } else {
            ++bound;
        }
    }
    const std::string on_core = " on core " + std::to_string(core);
    const std::string stuck = bound == 0 ? "" : ", " + std::to_string(bound) + " that cannot be moved";
    if (here.empty()) return {State::ok, "no movable interrupt" + on_core + stuck, ""};
    CpuList rest = CpuList::first(facts.core_count());
    rest.remove(core);
    return {State::better, std::to_string(here.size()) + on_core + ": " + some_of(here, 5) + stuck,
            facts.boot_with("irqaffinity=" + rest.to_list())};
}

Finding irqbalance(const Facts& facts) {
    if (!facts.runs("irqbalance")) return {State::ok, "not running", ""};
    return {State::better, "running", "sudo systemctl disable --now irqbalance"};
}

constexpr std::array kChecks{
    Check{"irq_affinity",
          "a device's interrupt on a loop's core makes a pulse late, until the board moves it",
          interrupt_affinity},
    Check{"irqbalance", "it puts interrupts back on the core from which the board has moved them",
          irqbalance},
};

}  // namespace

std::span<const Check> interrupt_checks() { return kChecks; }

}  // namespace qduino::apps::doctor
