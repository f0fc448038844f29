#include <algorithm>

#include "base/words.h"
#include "report/guarantee_report.h"
#include "terminal/human.h"
#include "terminal/message.h"

namespace qduino::apps {
namespace {

const char* yes_no(bool yes) { return yes ? "yes" : "NO"; }

/// A remark below its line; nothing when `text` is empty.
std::string remark(std::string_view text) { return text.empty() ? "" : wrapped(text, "         "); }

std::string loop_line(const board::LoopGuarantee& loop) {
    return text<std::string>(
        "  ", column(loop.id, -4), ' ', column(loop.core, -4), ' ', column(human_duration(loop.budget), 9),
        " / ", column(human_duration(loop.period), -9), "    ", column(yes_no(loop.priority_enforced), -9),
        ' ', column(yes_no(loop.budget_enforced), -9), loop.core_owned ? " owned\n" : " shared\n",
        remark(loop.escape), remark(loop.shortfall));
}

double percent(Nanoseconds part, Nanoseconds whole) {
    return 100 * to_seconds(part) / std::max(to_seconds(whole), 1e-9);
}

/// "10.9 % of its core, and 10 % are its own".
std::string share_of(const board::LoopGuarantee& loop) {
    return text<std::string>(Fixed{percent(loop.used, loop.watched), 1}, " % of its core, and ",
                             Fixed{percent(loop.budget, loop.period), 1}, " % are its own");
}

/// What kernel threads had of an I/O VCPU's budget.
std::string kernel_threads_line(const board::LoopGuarantee& loop) {
    return wrapped(text<std::string>("Bottom halves of io ", loop.id, ", with ",
                                     counted(loop.kernel_threads, "kernel thread"), ": ",
                                     Fixed{percent(loop.kernel_used, loop.watched), 1},
                                     " % of its core was charged to its budget of ",
                                     Fixed{percent(loop.budget, loop.period), 1}, " %; their rank was taken ",
                                     counted(loop.kernel_held, "time"), "."),
                   "");
}

std::string core_line(const board::CoreGuarantee& core) {
    std::string out = text<std::string>("  core ", core.core, ':');
    if (core.interrupts_per_second >= 0)
        write(out, ' ', Fixed{core.interrupts_per_second, 0}, " interrupts/s,");
    if (core.counted_per_second >= 0)
        write(out, " interrupts counted as ", human_duration(core.counted_at_once), " at once and ",
              Fixed{100 * core.counted_share, 1}, " % (", Fixed{core.counted_per_second, 0}, "/s of ",
              human_duration(core.counted_cost), "),");
    if (core.worst_gap.count() >= 0)
        write(out, " worst gap of a bare spin ", human_duration(core.worst_gap), ',');
    return write(out, core.tick_stopped ? " no tick," : " tick,",
                 core.throttling_lifted ? " no throttling\n" : " RT throttling\n", remark(core.note));
}

/// A line for each process tree, and its shortfall below it; empty without one.
std::string tree_table(const auto& trees) {
    if (trees.empty()) return "";
    std::string out = "  process tree     core    budget / period       admitted  budget\n";
    for (const board::TreeGuarantee& tree : trees) {
        write(out, "  ", column(tree.name.view(), -16), ' ', column(tree.core, -4), ' ',
              column(human_duration(tree.budget), 9), " / ", column(human_duration(tree.period), -9), "    ",
              column(yes_no(tree.admitted), -9), ' ', yes_no(tree.enforced), '\n', remark(tree.shortfall));
    }
    return out;
}

}  // namespace

std::string guarantee_text(const board::GuaranteeReport& report) {
    std::string out = text<std::string>("What holds on this board (", report.board, ", memory ",
                                        report.memory_locked ? "locked" : "NOT locked", "):\n",
                                        "  loop core    budget / period       priority  budget    core\n");
    for (const board::LoopGuarantee& loop : report.loops) out += loop_line(loop);
    for (const board::CoreGuarantee& core : report.cores) out += core_line(core);
    return out += tree_table(report.trees);
}

std::string in_a_word(const board::LoopGuarantee& loop) {
    if (!loop.priority_enforced) return "NO (no real-time priority)";
    if (!loop.budget_enforced) return "NO (its budget is not kept)";
    const bool wants_the_core = loop.parameters().whole_core();
    return wants_the_core && !loop.core_owned ? "mostly (its core is shared)" : "yes";
}

namespace {

/// What is to be said of one loop that was watched; nothing when it kept to its budget.
std::string budget_of(const board::LoopGuarantee& loop) {
    if (!loop.escape.empty()) {
        return wrapped(text<std::string>("Budget of loop ", loop.id, " NOT KEPT: ", loop.escape, ". It had ",
                                         share_of(loop), "."),
                       "");
    }
    if (loop.releases == 0)
        return text<std::string>("Budget of loop ", loop.id, ": never used, for the loop never ran.\n");
    if (!loop.taken.empty()) {
        return wrapped(text<std::string>("Budget of loop ", loop.id, ": ", loop.taken, ". It was charged ",
                                         share_of(loop), "."),
                       "");
    }
    return loop.budget_enforced
               ? ""
               : wrapped(
                     text<std::string>(
                         "Budget of loop ", loop.id, " NOT ENFORCED: ",
                         loop.shortfall.empty() ? "its thread keeps it alone" : loop.shortfall.view(), "."),
                     "");
}

}  // namespace

// What this says and what the JSON has are the same members of the report: "kept" is said of a loop
// that ran, was enforced, and was watched all along.
std::string budgets_kept(const board::GuaranteeReport& report) {
    std::string out;
    int watched = 0, kept = 0;
    Nanoseconds longest{};
    for (const board::LoopGuarantee& loop : report.loops) {
        if (loop.used < Nanoseconds{0}) continue;
        ++watched;
        longest = std::max(longest, loop.watched);
        const std::string said = budget_of(loop);
        if (said.empty()) ++kept;
        out += said;
    }
    if (watched == 0) return out;
    if (!report.watch_lost.empty()) {
        out += wrapped(text<std::string>("Budgets: NOT watched all along: ", report.watch_lost,
                                         ". What the loops took then, nobody knows."),
                       "");
    } else if (kept > 0) {
        write(out, kept == watched ? "Budgets: every one was kept (" : "Budgets: the others were kept (",
              counted(kept, "loop"), ").\n");
    }
    for (const board::LoopGuarantee& loop : report.loops)
        if (loop.kernel_used >= Nanoseconds{0}) out += kernel_threads_line(loop);
    write(out, "Watching them took ", Fixed{percent(report.watch_cost, longest), 2}, " % of a core.\n");
    if (!report.intruders.empty())
        out += wrapped(text<std::string>("In front of loops: ", report.intruders, "."), "");
    if (report.strange_threads > 0) {
        write(out, "The sketch made ", counted(report.strange_threads, "thread"),
              " while it ran: ordinary, and in nobody's budget.\n");
    }
    return out;
}

namespace {

/// What became of the promise: R from the edge to the handler's end, of one that finds budget.
std::string verdict_on(const board::BottomHalfGuarantee& half) {
    if (half.response < Nanoseconds{0}) return "Nothing was promised";
    const std::string promise = "R is " + human_duration(half.response);
    if (half.end_worst <= half.response) return promise + ": kept";
    const std::string waits =
        ", and it may wait " + human_duration(half.replenishment) + " for its budget before that";
    if (half.end_worst <= half.response + half.replenishment) return promise + waits + ": kept";
    return promise + waits + ": NOT kept. More came than its budget serves, or a handler took longer";
}

}  // namespace

std::string handlers_kept(const board::GuaranteeReport& report) {
    std::string out;
    for (const board::BottomHalfGuarantee& half : report.bottom_halves) {
        auto line = text<std::string>("Handlers of io ", half.id, ": ",
                                      counted(static_cast<long long>(half.timed + half.untimed), "edge"));
        if (half.timed > 0)
            write(line, ", begun ", human_duration(half.begin_median), " after it (50 %), ",
                  human_duration(half.begin_p999), " (99.9 %), ", human_duration(half.begin_worst),
                  " at worst; done ", human_duration(half.end_worst), " after it at worst. ",
                  verdict_on(half));
        if (half.untimed > 0) write(line, ". Of ", half.untimed, " nobody knows when they came");
        out += wrapped(line + ".", "");
    }
    return out;
}

namespace {

/// The kernel tells a hypervisor's time in steps of this.
constexpr Nanoseconds kHostStep = 10ms;

/// Whatever had the core for at least half of the delay.
const char* culprit(const board::DelayGuarantee& delay) {
    switch (cause_of(delay)) {
        case board::DelayCause::tasks:
            return "other tasks took its core";
        case board::DelayCause::host:
            return "the host took its core";
        case board::DelayCause::interrupts:
            return "interrupts took its core";
        case board::DelayCause::charged:
            return "the host or an interrupt ran on its budget, and it waited for the next";
        case board::DelayCause::work:
            return "it had spent its budget, and waited for the next";
        case board::DelayCause::untold:
            return "it was its own work, or it waited for its budget";
        case board::DelayCause::stopped:
            return "the whole program stood still: it was stopped (SIGSTOP, Ctrl-Z) or frozen, or its "
                   "computer was";
        case board::DelayCause::quota:
            return "a quota of its control group (cpu.max, cpu.cfs_quota_us) kept it waiting";
        case board::DelayCause::unseen:
            break;
    }
    if (!delay.owns_core) return "it slept or waited within its release, or was interrupted";
    if (delay.worst < kHostStep) return "it was an interrupt, or the host";
    return "it was an interrupt, or the host without saying so";
}

/// The causes of all its late releases, as they are counted.
constexpr Words<board::DelayCause::tasks, board::DelayCause::quota> kCauses{
    "other tasks",
    "the host",
    "interrupts",
    "the host or an interrupt ran on its budget",
    "its own work",
    "nothing that the kernel counts",
    "its own work or its budget",
    "the program stood still",
    "a quota"};

/// " 12 releases were late: 7 of them by the host, 5 by its own work."; nothing when none was
/// counted.
std::string late_ones(const board::DelayGuarantee& delay) {
    std::string causes;
    std::int64_t all = 0;
    for (std::size_t i = 0; i < delay.late.size(); ++i) {
        all += delay.late[i];
        if (delay.late[i] > 0)
            write(causes, causes.empty() ? "" : ", ", delay.late[i], " (",
                  kCauses(static_cast<board::DelayCause>(i)), ')');
    }
    return all == 0
               ? ""
               : text<std::string>(" Late in all: ", counted(all, "release"), ", by cause: ", causes, '.');
}

std::string delay_line(const board::DelayGuarantee& delay) {
    auto line =
        text<std::string>("Loop ", delay.id, " was late by ", human_duration(delay.worst), " at worst, ",
                          Fixed{to_seconds(delay.at), 0}, " s after it began: ", culprit(delay), ". In the ",
                          human_duration(delay.window), " before that, on core ", delay.core);
    if (delay.tasks >= Nanoseconds{0}) write(line, ", others ran for ", human_duration(delay.tasks));
    if (delay.host >= Nanoseconds{0}) write(line, ", the host for ", human_duration(delay.host));
    if (delay.interrupted > Nanoseconds{0})
        write(line, ", interrupts for ", human_duration(delay.interrupted));
    if (delay.interrupts >= 0)
        write(line, ", and ", counted(delay.interrupts, "interrupt"), " came (most: ", delay.most, ')');
    if (delay.stopped > Nanoseconds{0})
        write(line, ", the program stood still for ", human_duration(delay.stopped));
    if (delay.quota > Nanoseconds{0})
        write(line, ", its quota kept it waiting for ", human_duration(delay.quota));
    if (delay.beyond > Nanoseconds{0})
        write(line, "; ", human_duration(delay.beyond), " of it on the budget of the loop");
    return wrapped(line + "." + late_ones(delay), "");
}

std::string more_interrupts(const board::CoreGuarantee& core) {
    if (core.counted_per_second < 0 || core.without_alarms_per_second <= core.counted_per_second) return {};
    return wrapped(text<std::string>("Core ", core.core, " had ", Fixed{core.without_alarms_per_second, 0},
                                     " interrupts/s beside the alarms of programs, and admission counts ",
                                     Fixed{core.counted_per_second, 0}, ": R of its loops may be longer."),
                   "");
}

}  // namespace

std::string delays_explained(const board::GuaranteeReport& report) {
    std::string out;
    for (const board::CoreGuarantee& core : report.cores) out += more_interrupts(core);
    for (const board::DelayGuarantee& delay : report.delays) out += delay_line(delay);
    return out;
}

}  // namespace qduino::apps
