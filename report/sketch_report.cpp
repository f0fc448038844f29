#include "report/sketch_report.h"

#include <algorithm>

#include "report/chain_report.h"
#include "report/lock_report.h"
#include "terminal/human.h"

namespace qduino::apps {
namespace {

std::string cell(const auto& piece, int width) { return ' ' + column(piece, width); }

std::string text_of(std::uint64_t ns) { return human_duration(Nanoseconds{static_cast<std::int64_t>(ns)}); }

long long sum_of(const std::vector<const runtime::Loop*>& loops,
                 runtime::Counter runtime::LoopStatistics::*counter) {
    long long sum = 0;
    for (const runtime::Loop* loop : loops) sum += static_cast<long long>((loop->statistics.*counter).get());
    return sum;
}

/// How long the release in hand has lasted, of a loop that waits for its periods, or has not come
/// to the end of its body yet; else nothing. The classic loop() has no periods that a person gave.
Nanoseconds length_of_release(const runtime::Loop& loop, Instant now) {
    const runtime::LoopStatistics& was = loop.statistics;
    if (was.ended.get() > 0 || was.releases.get() == 0) return Nanoseconds{0};
    const bool in_its_first = was.releases.get() == 1 && was.passes.get() <= 1 && !loop.declaration.classic;
    if (was.releases.get() < 2 && !in_its_first) return Nanoseconds{0};
    return std::max(now - instant_from_ns(was.release_began_ns.get()), Nanoseconds{0});
}

/// Whole periods that the release in hand has missed, at the end of a run.
long long missed_periods(const runtime::Loop& loop, Instant now) {
    return length_of_release(loop, now) / loop.declaration.period;
}

/// One that is still in a release, in a delay() or a poll, has missed all the others, and no
/// overrun has counted them yet.
std::string stuck_loops(const std::vector<const runtime::Loop*>& loops, Instant now) {
    std::string out;
    for (const runtime::Loop* loop : loops) {
        const long long missed = missed_periods(*loop, now);
        if (missed < 1) continue;
        write(out, "; loop ", loop->declaration.id, " has not ended a release for ",
              human_duration(length_of_release(*loop, now)), " and missed ", counted(missed, "period"));
    }
    return out;
}

/// Those whose core was taken: one whose first release never began, and one that woke a period late
/// or more, when the end of the run had come, so that no overrun has counted it.
std::string starved_loops(const std::vector<const runtime::Loop*>& loops) {
    std::string out;
    for (const runtime::Loop* loop : loops) {
        const runtime::LoopStatistics& was = loop->statistics;
        const Nanoseconds latency{static_cast<std::int64_t>(was.release_latency_ns.max())};
        if (was.releases.get() == 0) {
            write(out, "; loop ", loop->declaration.id, " never ran");
        } else if (was.ended.get() > 0 && was.overruns.get() == 0 && latency > loop->declaration.period) {
            write(out, "; loop ", loop->declaration.id, " began a release ", human_duration(latency),
                  " after it was due");
        }
    }
    return out;
}

}  // namespace

std::string loop_table(const std::vector<const runtime::Loop*>& loops) {
    std::string table =
        "                                                        release latency\n"
        "loop   passes releases overruns dropped  worst late      p50    p99.9      max\n";
    for (const runtime::Loop* loop : loops) {
        const runtime::LoopStatistics& was = loop->statistics;
        const Histogram& latency = was.release_latency_ns;
        write(table, column(loop->declaration.id, 4), cell(was.passes.get(), 8), cell(was.releases.get(), 8),
              cell(was.overruns.get(), 8), cell(was.dropped.get(), 7), ' ',
              cell(human_duration(Nanoseconds{was.lateness_ns_max.get()}), 10),
              cell(text_of(latency.quantile(0.5)), 8), cell(text_of(latency.quantile(0.999)), 8),
              cell(text_of(latency.max()), 8), '\n');
    }
    return table;
}

namespace {

/// Calls `visit` with each loop that slept longer within a release than it declares, or in more
/// pieces, where that does not fit, or it was late: for how long, in how many, and its R with that.
template <typename Visit>
void each_sleeper(const runtime::Runtime& runtime, Visit visit) {
    if (!runtime.plan().admitted()) return;
    for (const runtime::Loop* loop : loops_of(runtime)) {
        const Nanoseconds slept{loop->statistics.slept_ns_max.get()};
        const runtime::LoopDeclaration& declared = loop->declaration;
        const int pieces = std::max(static_cast<int>(loop->statistics.sleeps_max.get()), 1);
        if (loop->owns_core || (slept <= declared.suspension && pieces <= declared.sleeps)) continue;
        const sched::LoopResponse response = runtime.plan().response_with_sleep(
            declared.id, std::max(slept, declared.suspension), std::max(pieces, declared.sleeps));
        const bool pays = pieces > declared.times_asleep() && loop->statistics.overruns.get() > 0;
        if (!response.meets() || pays) visit(declared, slept, pieces, response);
    }
}

}  // namespace

std::string sleep_notes(const runtime::Runtime& runtime) {
    std::string notes;
    each_sleeper(runtime, [&](const auto& declared, Nanoseconds slept, int pieces,
                              const sched::LoopResponse& response) {
        write(notes, "loop ", declared.id, " slept up to ", human_duration(slept),
              " within a release and declares ", human_duration(declared.suspension));
        if (pieces > 1) write(notes, ", in ", pieces, " pieces and declares ", declared.times_asleep());
        if (response.meets()) {
            write(notes, ".\n  It pays for the switches of the further ones from its own budget.\n");
            return;
        }
        write(notes, ".\n  With that, R = ", human_duration(response.response),
              " > T = ", human_duration(response.period), ": it would not be admitted.\n");
    });
    return notes;
}

std::string sleep_verdict(const runtime::Runtime& runtime) {
    std::string out;
    each_sleeper(runtime, [&](const auto& declared, Nanoseconds, int, const sched::LoopResponse&) {
        write(out, out.empty() ? "; undeclared sleep: " : ", ", "loop ", declared.id);
    });
    return out;
}

std::string periods_kept(const std::vector<const runtime::Loop*>& loops, Instant now) {
    const long long overruns = sum_of(loops, &runtime::LoopStatistics::overruns);
    const std::string stuck = starved_loops(loops) + stuck_loops(loops, now);
    return text<std::string>(overruns > 0     ? counted(overruns, "OVERRUN")
                             : !stuck.empty() ? "NOT every period was kept"
                                              : "every period was kept",
                             " (", counted(static_cast<long long>(loops.size()), "loop"), ", ",
                             counted(sum_of(loops, &runtime::LoopStatistics::releases), "release"), ')',
                             stuck);
}

std::string loops_left(const std::vector<const runtime::Loop*>& loops) {
    std::string out;
    for (const runtime::Loop* loop : loops) {
        if (loop->statistics.ended.get() > 0) continue;
        write(out, out.empty() ? "" : ", ", "loop ", loop->declaration.id,
              loop->statistics.releases.get() == 0 ? " never ran" : " has not ended");
    }
    return out.empty() ? "an I/O VCPU has not ended" : out;
}

std::string run_report(const runtime::Runtime& runtime, Instant now) {
    const std::vector<const runtime::Loop*> loops = loops_of(runtime);
    return text<std::string>(loop_table(loops), "Periods: ", periods_kept(loops, now), sleep_verdict(runtime),
                             lock_verdict(runtime, runtime::sketch_table()), chain_verdict(runtime), ".\n",
                             chain_lines(runtime));
}

namespace {

/// How the loops have kept their periods up to `now`. While they run on, a wake-up may be late: one
/// that is in the period after its own has not missed it yet.
void add_periods(board::GuaranteeReport& report, runtime::Runtime& runtime, Instant now) {
    for (board::LoopGuarantee& line : report.loops) {
        const runtime::Loop* loop = runtime.loop(line.id);
        if (!loop) continue;  // a bottom half has no periods of its own
        const runtime::LoopStatistics& was = loop->statistics;
        line.releases = was.releases.get();
        line.overruns = was.overruns.get();
        line.dropped = was.dropped.get();
        const bool runs_on = !runtime.board().stop_requested();
        line.missed = std::max<std::int64_t>(missed_periods(*loop, now) - (runs_on ? 1 : 0), 0);
        line.worst_late = Nanoseconds{was.lateness_ns_max.get()};
    }
}

/// From what the watches keep: the plan belongs to the loop that makes a change.
void add_chains(board::GuaranteeReport& report, const runtime::Runtime& runtime) {
    for (std::size_t i = 0; i < runtime::kChainLimit; ++i) {
        const runtime::ChainWatch* const watch = runtime.chain_watch(i);
        if (!watch) continue;
        const runtime::Chain& chain = watch->chain();
        report.chains.push_back({.name = chain.name,
                                 .way = runtime::way_of(chain),
                                 .reaction_bound = watch->reaction_bound(),
                                 .reaction_limit = chain.limits.reaction,
                                 .age_bound = watch->age_bound(),
                                 .age_limit = chain.limits.age,
                                 .reactions = watch->count(),
                                 .worst_reaction = watch->reaction(),
                                 .worst_age = watch->age(),
                                 .from_first_loop = watch->begins_at_a_loop()});
    }
}

}  // namespace

board::GuaranteeReport guarantee_of(runtime::Runtime& runtime) {
    board::GuaranteeReport report = runtime.board().guarantee();
    add_periods(report, runtime, runtime.board().now());
    add_chains(report, runtime);
    if (!runtime.plan().admitted()) return report;
    for (const sched::Admission& core : runtime.plan().admission().cores) {
        for (const sched::IoResponse& promise : core.ios) {
            auto* const half =
                std::ranges::find(report.bottom_halves, promise.id, &board::BottomHalfGuarantee::id);
            if (half == report.bottom_halves.end() ||
                promise.response > sched::kResponseLimit * promise.replenishment)
                continue;
            half->response = promise.response;
            half->replenishment = promise.replenishment;
        }
    }
    return report;
}

std::vector<const runtime::Loop*> loops_of(const runtime::Runtime& runtime) {
    std::vector<const runtime::Loop*> loops;
    for (board::VcpuId id = 1; id <= board::kMaxLoop; ++id) {
        if (const runtime::Loop* loop = runtime.loop(id); loop && loop->declaration.body)
            loops.push_back(loop);
    }
    return loops;
}

}  // namespace qduino::apps
