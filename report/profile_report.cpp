#include "report/profile_report.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/text.h"
#include "report/chain_report.h"
#include "report/sketch_report.h"
#include "sched/explain.h"
#include "terminal/human.h"

namespace qduino::apps {
namespace {

using Json = nlohmann::ordered_json;
using runtime::Execution;
using runtime::ExecutionProfile;
using runtime::Loop;
using runtime::Runtime;

/// Fewer releases say too little.
constexpr std::int64_t kRunsAtLeast = 20;
/// To enforce a shorter budget costs more than the budget (board/linux/loop/crew.h).
constexpr Nanoseconds kBudgetAtLeast = 100us;

Nanoseconds duration_of(std::uint64_t ns) { return Nanoseconds{static_cast<std::int64_t>(ns)}; }

Nanoseconds with_margin(Nanoseconds value, double margin) {
    return rounded_up(
        Nanoseconds{static_cast<std::int64_t>(std::ceil(static_cast<double>(value.count()) * (1 + margin)))});
}

/// Its budget was too short and ended its releases: how long they were says nothing of its period.
bool was_cut(const Loop& loop) {
    const board::GuaranteeReport held = board::current().guarantee();
    const bool enforced = std::ranges::any_of(held.loops, [&](const board::LoopGuarantee& guaranteed) {
        return guaranteed.id == loop.declaration.id && guaranteed.budget_enforced;
    });
    return enforced && duration_of(loop.profile->cpu_ns().max()) > loop.declaration.budget;
}

/// It ends its releases itself; else its passes are counted.
bool waits(const Loop& loop) { return loop.statistics.releases.get() > 1; }

std::string causes_of(const Execution& execution) {
    std::string out;
    const auto add = [&out](std::int64_t count, const std::string& what) {
        if (count > 0) write(out, out.empty() ? "" : ", ", counted(count, what));
    };
    if (execution.number == 1) out = "the first";
    add(execution.met.page_faults, "page fault");
    add(execution.met.preemptions, "preemption");
    if (execution.met.throttles > 0) write(out, out.empty() ? "" : ", ", "its budget ended");
    return out.empty() ? "its own code: nothing else was seen" : out;
}

std::string worst_text(const ExecutionProfile& profile, const char* unit, Instant begin) {
    std::string out;
    const char* lead = "  worst ";
    for (const Execution& execution : profile.worst()) {
        if (execution.number == 0) break;
        write(out, lead, column(human_duration(execution.cpu), 8), " in ", unit, ' ', execution.number,
              " at ", Fixed{to_seconds(execution.began - begin), 3}, " s: ", causes_of(execution), '\n');
        lead = "        ";
    }
    if (profile.throttled() > 0) {
        write(out, "  Its budget ended in ", profile.throttled(), " of them, and each end is in its time.\n");
    }
    return out;
}

std::string row(const std::string& name, const std::string& runs, const std::string& median,
                const std::string& p99, const std::string& worst, const std::string& change) {
    return text<std::string>(column(name, -10), column(runs, 9), column(median, 10), column(p99, 10),
                             column(worst, 10), "   ", change, '\n');
}

std::string row_of(const std::string& name, const ExecutionProfile& profile, const std::string& change) {
    const auto quantile = [&](double q) { return human_duration(duration_of(profile.cpu_ns().quantile(q))); };
    return row(name, std::to_string(profile.count()), quantile(0.5), quantile(0.99),
               human_duration(duration_of(profile.cpu_ns().max())), change);
}

std::string change_of(const sched::VcpuParameters& declared, const Suggestion& suggestion) {
    if (!suggestion.made()) return suggestion.why_not;
    std::string out = text<std::string>("C ", declared.budget, " -> ", suggestion.budget);
    if (suggestion.period != declared.period) write(out, ", T ", declared.period, " -> ", suggestion.period);
    return out;
}

/// As the sketch declared it. Contract: the pin has a handler.
const sched::Vcpu& io_of(const Runtime& runtime, std::uint16_t pin) {
    const auto& placed = runtime.plan().admission().placed;
    const auto* const io = std::ranges::find(placed, runtime.handler_vcpu({pin}), &sched::Vcpu::id);
    QDUINO_EXPECT(io != placed.end());
    return *io;
}

template <typename Visit>
void each_handler(const Runtime& runtime, Visit visit) {
    for (std::uint16_t number = 0; number < board::kPinCount; ++number) {
        const ExecutionProfile* profile = runtime.handler_profile({number});
        if (profile && profile->count() > 0) visit(number, *profile);
    }
}

/// The sketch as suggested, put to admission beside its I/O VCPUs, with the overheads that were
/// counted for the run. Declared critical sections are not in it.
runtime::Plan plan_of(const Runtime& runtime, double margin) {
    const sched::MulticoreAdmission& was = runtime.plan().admission();
    std::vector<sched::PlatformOverheads> overheads(static_cast<std::size_t>(board::current().core_count()));
    for (const sched::CoreLoad& load : was.loads)
        overheads[static_cast<std::size_t>(load.core)] = load.overheads;
    runtime::SketchTable table;
    for (const Loop* loop : loops_of(runtime)) {
        table.loops.push_back(loop->declaration);
        const Suggestion suggestion = suggestion_for(*loop, margin);
        if (!suggestion.made()) continue;
        table.loops.back().budget = suggestion.budget;
        table.loops.back().period = suggestion.period;
    }
    runtime::Plan plan{true};
    for (const runtime::ChainVerdict& chain : runtime.plan().chains()) plan.add_chain(chain.chain);
    // The plan says itself whether it is admitted.
    static_cast<void>(plan.add_loops(table));
    for (const sched::Vcpu& vcpu : was.placed) {
        if (!vcpu.is_io()) continue;
        Nanoseconds budget = vcpu.budget;
        each_handler(runtime, [&](std::uint16_t pin, const ExecutionProfile&) {
            if (runtime.handler_vcpu({pin}) != vcpu.id) return;
            if (const Suggestion made = suggestion_for(runtime, {pin}, margin); made.made())
                budget = made.budget;
        });
        static_cast<void>(plan.add_io(budget, vcpu.period, vcpu.core));
    }
    static_cast<void>(plan.admit(overheads));
    return plan;
}

std::string handlers_text(const Runtime& runtime, double margin) {
    std::string out;
    each_handler(runtime, [&](std::uint16_t pin, const ExecutionProfile& profile) {
        const std::string change =
            change_of(io_of(runtime, pin).parameters(), suggestion_for(runtime, {pin}, margin));
        out += row_of(text<std::string>("pin ", pin), profile, change);
        out += worst_text(profile, "run", runtime.made_at());
        write(out, "  busiest ", human_duration(profile.busiest()), " in one T");
        if (profile.count() > 1) write(out, "; gaps from ", human_duration(profile.least_gap()));
        out += '\n';
    });
    return out.empty() ? out : "\nHandlers of interrupts, each run (gaps: from one to the next):\n" + out;
}

std::string rule_text(const Runtime& runtime, const ProfiledRun& run) {
    const runtime::Plan plan = plan_of(runtime, run.margin);
    return text<std::string>(
        "\nSuggested: C is the worst observed and ", Shortest{run.margin * 100},
        " % more, rounded up to two digits,\n100 us at least. T stays, unless C is longer, or half of all "
        "releases are.\nWhat was not observed may take longer.\n",
        board::current().guarantee().simulated
            ? "In virtual time code takes none: only spins, and what the board file says. Take\n"
              "budgets from a run on the computer.\n"
            : "",
        "\nWith these: ", plan.admitted() ? "admitted\n" : "REFUSED\n",
        plan.admission().placed.empty() ? plan.explanation().view() : plan.admission_table().view());
}

// ---- JSON ---------------------------------------------------------------------------------------

Json json_of(const ExecutionProfile& profile, Instant begin) {
    const Histogram& cpu = profile.cpu_ns();
    Json worst = Json::array(), buckets = Json::array();
    for (const Execution& execution : profile.worst()) {
        if (execution.number == 0) break;
        worst.push_back({{"cpu_ns", execution.cpu.count()},
                         {"number", execution.number},
                         {"at_ns", (execution.began - begin).count()},
                         {"page_faults", execution.met.page_faults},
                         {"preemptions", execution.met.preemptions},
                         {"throttles", execution.met.throttles}});
    }
    for (int i = 0; i < Histogram::kBuckets; ++i) {
        if (cpu.bucket_count(i) > 0) buckets.push_back({Histogram::upper_bound_of(i), cpu.bucket_count(i)});
    }
    return {{"count", profile.count()},       {"mean_ns", std::llround(cpu.mean())},
            {"median_ns", cpu.quantile(0.5)}, {"p99_ns", cpu.quantile(0.99)},
            {"worst_ns", cpu.max()},          {"throttled", profile.throttled()},
            {"worst", std::move(worst)},      {"histogram", std::move(buckets)}};
}

void add_change(Json& json, const sched::VcpuParameters& declared, const Suggestion& suggestion) {
    json["declared"] = {{"budget_ns", declared.budget.count()}, {"period_ns", declared.period.count()}};
    json["suggested"] = nullptr;
    if (suggestion.made()) {
        json["suggested"] = {{"budget_ns", suggestion.budget.count()},
                             {"period_ns", suggestion.period.count()}};
    }
    json["why_not"] = suggestion.why_not;
}

Json json_of(const Loop& loop, const ProfiledRun& run, Instant begin) {
    const runtime::LoopDeclaration& declared = loop.declaration;
    const Suggestion suggestion = suggestion_for(loop, run.margin);
    Json json{{"id", declared.id}, {"each", waits(loop) ? "release" : "pass"}};
    json.update(json_of(*loop.profile, begin));
    add_change(json, {declared.budget, declared.period}, suggestion);
    json["file"] = declared.file;
    json["line"] = declared.line;
    return json;
}

/// What was seen of each chain, beside its bound.
Json chains_json(const Runtime& runtime) {
    Json chains = Json::array();
    for (const ChainSeen& seen : chains_seen(runtime)) {
        const sched::ChainBound& bound = seen.chain->bound;
        chains.push_back({{"name", seen.chain->chain.name.view()},
                          {"reactions", seen.count},
                          {"reaction_ns", seen.reaction.count()},
                          {"reaction_bound_ns", bound.reaction.count()},
                          {"age_ns", bound.has_age ? Json(seen.age.count()) : Json(nullptr)},
                          {"age_bound_ns", bound.has_age ? Json(bound.age.count()) : Json(nullptr)}});
    }
    return chains;
}

}  // namespace

Nanoseconds rounded_up(Nanoseconds value) {
    std::int64_t unit = 1;
    while (value.count() > 99 * unit) unit *= 10;
    return Nanoseconds{(value.count() + unit - 1) / unit * unit};
}

Suggestion suggestion_for(const Loop& loop, double margin) {
    const runtime::LoopDeclaration& declared = loop.declaration;
    Suggestion suggestion{declared.budget, declared.period, {}};
    if (loop.owns_core) {
        suggestion.why_not = "owns its core";
    } else if (!waits(loop)) {
        suggestion.why_not = "waits for no period";
    } else if (loop.profile->count() < kRunsAtLeast) {
        suggestion.why_not = "too few: run longer";
    }
    if (!suggestion.made()) return suggestion;
    const ExecutionProfile& profile = *loop.profile;
    suggestion.budget = std::max(with_margin(duration_of(profile.cpu_ns().max()), margin),
                                 std::min(kBudgetAtLeast, declared.budget));
    if (!was_cut(loop) && duration_of(profile.length_ns().quantile(0.5)) > declared.period)
        suggestion.period = with_margin(duration_of(profile.length_ns().quantile(0.99)), margin);
    suggestion.period = std::max(suggestion.period, suggestion.budget);
    return suggestion;
}

Suggestion suggestion_for(const Runtime& runtime, board::PinId pin, double margin) {
    const ExecutionProfile& profile = *runtime.handler_profile(pin);
    const sched::Vcpu& io = io_of(runtime, pin.number);
    Suggestion suggestion{io.budget, io.period, {}};
    if (profile.busiest() == Nanoseconds{0}) {
        suggestion.why_not = "has no VCPU of its own: see interruptsVcpu()";
    } else if (profile.count() < kRunsAtLeast) {
        suggestion.why_not = "too few: run longer";
    } else {
        suggestion.budget =
            std::max(with_margin(profile.busiest(), margin), std::min(kBudgetAtLeast, io.budget));
    }
    if (suggestion.budget > io.period) suggestion.why_not = "needs more than its period";
    return suggestion;
}

std::string profile_text(const Runtime& runtime, const ProfiledRun& run) {
    std::string out = "CPU time of each release (of each pass, where a loop waits for no period):\n\n";
    out += row("", "count", "median", "99 %", "worst", "suggested");
    for (const Loop* loop : loops_of(runtime)) {
        const Suggestion suggestion = suggestion_for(*loop, run.margin);
        const sched::VcpuParameters declared{loop->declaration.budget, loop->declaration.period};
        out +=
            row_of(runtime::vcpu_name(loop->declaration.id), *loop->profile, change_of(declared, suggestion));
        out += worst_text(*loop->profile, waits(*loop) ? "release" : "pass", runtime.made_at());
    }
    return out + handlers_text(runtime, run.margin) + rule_text(runtime, run);
}

std::string profile_json(const Runtime& runtime, const ProfiledRun& run) {
    const board::GuaranteeReport board = board::current().guarantee();
    Json loops = Json::array(), handlers = Json::array();
    for (const Loop* loop : loops_of(runtime)) loops.push_back(json_of(*loop, run, runtime.made_at()));
    each_handler(runtime, [&](std::uint16_t pin, const ExecutionProfile& profile) {
        Json json{{"pin", pin}, {"io", runtime.handler_vcpu({pin})}};
        json.update(json_of(profile, runtime.made_at()));
        if (profile.count() > 1) json["least_gap_ns"] = profile.least_gap().count();
        json["busiest_ns"] = profile.busiest().count();
        add_change(json, io_of(runtime, pin).parameters(), suggestion_for(runtime, {pin}, run.margin));
        handlers.push_back(std::move(json));
    });
    const bool enforced = std::ranges::any_of(board.loops, [](const auto& l) { return l.budget_enforced; });
    const Json json{{"sketch", run.sketch},
                    {"board", board.board.view()},
                    {"simulated", board.simulated},
                    {"budgets_enforced", enforced},
                    {"length_ns", (run.end - runtime.made_at()).count()},
                    {"margin", run.margin},
                    {"loops", std::move(loops)},
                    {"handlers", std::move(handlers)},
                    {"chains", chains_json(runtime)},
                    {"admitted", plan_of(runtime, run.margin).admitted()}};
    return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace qduino::apps
