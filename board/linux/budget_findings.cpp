#include "board/linux/budget_findings.h"

#include <algorithm>

#include "base/text.h"

namespace qduino::board::linux {

namespace {

void add_to(FixedString<200>& shortfall, std::string_view more) {
    write(shortfall, shortfall.empty() ? "" : "; ", more);
}

/// What kept the thread's own timer from ending its budget.
std::string_view way_out(EscapeWay way, const VcpuThread& thread) {
    if (way == EscapeWay::signal_blocked) return "it blocks the signal of its budget's timer";
    if (const std::string_view tampering = thread.tampering(); !tampering.empty()) return tampering;
    if (way == EscapeWay::signal_ignored) return "the signal of its budget's timer is ignored";
    return "its budget's timer did not stop it (a long system call, a lock, its own handler)";
}

}  // namespace

void describe_budget(LoopGuarantee& loop, const VcpuThread& thread, const Warden& warden,
                     std::string_view shortfall) {
    const WardenFindings* findings = warden.findings();
    if (findings) {
        const WardFindings& ward = findings->wards[loop.id];
        loop.used = Nanoseconds{ward.used_ns};
        loop.watched = Nanoseconds{ward.watched_ns};
        loop.held = ward.holds;
        if (loop.held > 0) {
            write(loop.escape, way_out(ward.way, thread), "; it was stopped from outside ", loop.held,
                  loop.held == 1 ? " time" : " times");
        } else if (ward.changes > 0) {
            write(loop.escape, "somebody changed its priority or its core, and it was put back");
        }
    }
    if (!warden.watches()) {
        loop.budget_enforced = false;
        add_to(loop.shortfall, "nobody outside of the loop keeps its budget");
        if (!shortfall.empty()) add_to(loop.shortfall, shortfall);
    } else if (findings->state == WardenState::only_rank) {
        loop.budget_enforced = false;
        add_to(loop.shortfall, "ptrace is refused here: beyond its budget it runs on, without its priority");
    }
    if (!loop.escape.empty()) loop.budget_enforced = false;
}

void describe_kernel_threads(LoopGuarantee& loop, std::span<const KernelThread> threads,
                             const Warden& warden) {
    loop.kernel_threads = static_cast<std::uint32_t>(std::ranges::count(threads, loop.id, &KernelThread::io));
    if (loop.kernel_threads == 0) return;
    if (!warden.watches() || loop.used < Nanoseconds{0}) {
        add_to(loop.shortfall, "nobody keeps them to its budget");
        return;
    }
    const WardFindings& ward = warden.findings()->wards[loop.id];
    loop.kernel_used = Nanoseconds{ward.kernel_used_ns};
    loop.kernel_held = ward.kernel_holds;
}

void describe_watch(GuaranteeReport& report, const Warden& warden) {
    const WardenFindings* findings = warden.findings();
    if (!findings) return;
    report.watch_cost = Nanoseconds{findings->cpu_ns};
    report.strange_threads = findings->strangers;
}

}  // namespace qduino::board::linux
