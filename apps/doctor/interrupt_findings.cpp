// The interrupts that reach the core that a loop would own, and the programs that move them.
#include <array>

#include "apps/doctor/finding.h"
#include "board/linux/device_interrupts.h"

namespace qduino::apps::doctor {
namespace {

using board::linux::CpuList;
using board::linux::Interrupt;

/// Interrupts with a handler that go to the core of a loop.
std::vector<Interrupt> interrupts_on_core(const Facts& facts) {
    const int core = facts.owned_core();
    std::vector<Interrupt> here;
    for (Interrupt& irq : board::linux::all_interrupts(facts.at(""))) {
        if (irq.used && irq.target.has(core)) here.push_back(std::move(irq));
    }
    return here;
}

Finding interrupt_affinity(const Facts& facts) {
    if (facts.core_count() < 2) return ok("one core only: nothing can be moved");
    const int core = facts.owned_core();
    std::vector<std::string> here;
    for (const Interrupt& irq : interrupts_on_core(facts)) {
        if (irq.movable) here.push_back(irq.name());
    }
    const std::string on_core = " on core " + std::to_string(core);
    if (here.empty()) return ok("no movable interrupt" + on_core);
    CpuList rest = CpuList::first(facts.core_count());
    rest.remove(core);
    return better(std::to_string(here.size()) + on_core + ": " + some_of(here, 5),
                  facts.boot_with("irqaffinity=" + rest.to_list()));
}

/// Only interrupts that could be elsewhere. A disk with a queue for each core is none: the core's
/// own queue is silent while the core is not used.
Finding managed_interrupts(const Facts& facts) {
    if (facts.core_count() < 2) return ok("one core only: nothing can be moved");
    std::vector<std::string> here;
    for (const Interrupt& irq : interrupts_on_core(facts)) {
        if (!irq.movable && irq.allowed.size() > 1) here.push_back(irq.name());
    }
    const std::string core = facts.owned_core_name();
    if (here.empty()) return ok("none on core " + core);
    const char* kept =
        facts.boot_parameter("isolcpus") ? "isolcpus=managed_irq,domain," : "isolcpus=managed_irq,";
    return better(some_of(here, 5) + " on core " + core, facts.boot_with(kept + core));
}

Finding irqbalance(const Facts& facts) {
    if (!facts.runs("irqbalance")) return ok("not running");
    return better("running", "sudo systemctl disable --now irqbalance");
}

constexpr std::array kChecks{
    Check{"irq_affinity",
          "a device's interrupt on a loop's core makes a pulse late, until the board moves it",
          interrupt_affinity},
    Check{"managed_irqs", "its driver keeps it on a loop's core, with the threads that finish its work",
          managed_interrupts},
    Check{"irqbalance", "it puts interrupts back on the core from which the board has moved them",
          irqbalance},
};

}  // namespace

std::span<const Check> interrupt_checks() { return kChecks; }

}  // namespace qduino::apps::doctor
