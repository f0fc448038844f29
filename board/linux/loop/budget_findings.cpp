#include "board/linux/loop/budget_findings.h"

#include <algorithm>

#include "base/text.h"

namespace qduino::board::linux {

namespace {

void add_to(FixedString<200>& shortfall, std::string_view more) {
    write(shortfall, shortfall.empty() ? "" : "; ", more);
}

const StrangerFindings* lent_by(VcpuId loop, const WardenFindings& findings) {
    for (const StrangerFindings& each : findings.named) {
        if (each.kind == StrangerKind::lent && each.lender == loop) return &each;
    }
    return nullptr;
}

void add_way_out(FixedString<160>& escape, EscapeWay way, const VcpuThread& thread,
                 const StrangerFindings* borrower) {
    if (way == EscapeWay::lent && borrower) {
        write(escape, "it waited for a lock of the thread '", std::string_view{borrower->name.data()},
              "', which ran at its priority");
    } else if (way == EscapeWay::signal_blocked) {
        write(escape, "it blocks the signal of its budget's timer");
    } else if (const std::string_view tampering = thread.tampering(); !tampering.empty()) {
        write(escape, tampering);
    } else if (way == EscapeWay::signal_ignored) {
        write(escape, "the signal of its budget's timer is ignored");
    } else {
        write(escape, "its budget's timer did not stop it (a long system call, a lock, its own handler)");
    }
}

/// It was stopped from outside, and can have done nothing to deserve it: its signal and its timer
/// are as they were, its own keeper saw it charged beyond the end of its budget, and the kernel
/// counts at least half of that as the host's or the interrupts' on its core.
bool could_not_help_it(EscapeWay way, const VcpuThread& thread, Nanoseconds taken) {
    const Nanoseconds beyond = thread.beyond();
    return way == EscapeWay::unknown && thread.tampering().empty() && beyond > Nanoseconds{0} &&
           taken >= beyond / 2;
}

}  // namespace

void describe_budget(LoopGuarantee& loop, const VcpuThread& thread, const Warden& warden,
                     std::string_view shortfall, Nanoseconds taken) {
    const WardenFindings* findings = warden.findings();
    if (findings) {
        const WardFindings& ward = findings->wards[loop.id];
        loop.used = Nanoseconds{ward.used_ns};
        loop.watched = Nanoseconds{ward.watched_ns};
        loop.held = ward.holds;
        const char* const times = loop.held == 1 ? " time" : " times";
        if (loop.held > 0 && could_not_help_it(ward.way, thread, taken)) {
            write(loop.taken, "the host or interrupts ran on it for ", thread.beyond() / 1ms,
                  " ms; it was stopped from outside ", loop.held, times, " for that");
        } else if (loop.held > 0) {
            add_way_out(loop.escape, ward.way, thread, lent_by(loop.id, *findings));
            write(loop.escape, "; it was stopped from outside ", loop.held, times);
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
    report.watch_lost = warden.lapse();
    for (const StrangerFindings& each : findings->named) {
        if (each.kind == StrangerKind::none) break;
        const bool lent = each.kind == StrangerKind::lent;
        write(report.intruders, report.intruders.empty() ? "" : "; ",
              each.kind == StrangerKind::process_ranked ? "the process '" : "the thread '",
              std::string_view{each.name.data()}, "' of the sketch ",
              lent ? "ran at the priority of loop " : "made itself real-time, and was stopped");
        if (!lent) continue;
        write(report.intruders, each.lender.load(), " for ", Nanoseconds{each.cpu_ns} / 1ms,
              " ms, as the loop waited for its lock; the loop's budget paid");
    }
    if (findings->all_stopped) write(report.intruders, "; so were all others that are no loops");
}

}  // namespace qduino::board::linux
