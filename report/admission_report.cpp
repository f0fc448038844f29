#include "report/admission_report.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "base/text.h"
#include "base/words.h"
#include "report/interferer_json.h"
#include "sched/explain.h"
#include "terminal/human.h"
#include "terminal/message.h"

namespace qduino::apps {
namespace {

using Json = nlohmann::ordered_json;
using runtime::LoopDeclaration;
using runtime::Plan;
using runtime::SketchTable;
using sched::RefusedBecause;

std::string text_of(Nanoseconds duration) { return text<std::string>(duration); }

constexpr Words<sched::AdmittedBy::bound, sched::AdmittedBy::owned> kAdmittedBy{"bound", "completion_time",
                                                                                "owned"};

constexpr Words<RefusedBecause::none, RefusedBecause::no_core_fits> kRefusedBecause{
    "none",     "bad_parameters", "duplicate_id",    "core_owned",   "no_such_core",
    "too_many", "io_overload",    "completion_time", "late_service", "no_core_fits"};

constexpr Words<sched::Share::Kind::own, sched::Share::Kind::overhead> kShares{
    "own", "sleep", "blocking", "remote", "loop", "io", "platform", "overhead"};

const LoopDeclaration* declaration_of(const SketchTable& table, board::VcpuId id) {
    const auto* const at = std::ranges::find(table.loops, id, &LoopDeclaration::id);
    return at == table.loops.end() ? nullptr : &*at;
}

/// R of a loop, where its core was analysed.
const sched::LoopResponse* response_of(const Plan& plan, board::VcpuId id) {
    for (const sched::Admission& core : plan.admission().cores) {
        for (const sched::LoopResponse& loop : core.loops) {
            if (loop.id == id) return &loop;
        }
    }
    return nullptr;
}

/// R of a bottom half, likewise.
const sched::IoResponse* io_response_of(const Plan& plan, board::VcpuId id) {
    for (const sched::Admission& core : plan.admission().cores) {
        for (const sched::IoResponse& io : core.ios) {
            if (io.id == id) return &io;
        }
    }
    return nullptr;
}

bool endless(const sched::LoopResponse& loop) { return loop.response > sched::kResponseLimit * loop.period; }
bool endless(const sched::IoResponse& io) { return io.response > sched::kResponseLimit * io.replenishment; }

template <typename Response>
std::string response_text(const Response* response) {
    return !response ? "-" : endless(*response) ? "never" : text_of(response->response);
}

std::string_view file_name(std::string_view path) { return path.substr(path.find_last_of('/') + 1); }

// ---- text ---------------------------------------------------------------------------------------

std::string row(const std::string& vcpu, const std::string& core, const std::string& budget,
                const std::string& period, const std::string& r, const std::string& place) {
    return text<std::string>(column(vcpu, -8), ' ', column(core, 4), ' ', column(budget, 13), ' ',
                             column(period, 13), ' ', column(r, 13), "  ", place.substr(0, 22), '\n');
}

std::string vcpu_line(const Plan& plan, const SketchTable& table, const sched::Vcpu& vcpu) {
    const LoopDeclaration* declared = vcpu.is_io() ? nullptr : declaration_of(table, vcpu.id);
    const std::string core = vcpu.core == sched::kAnyCore ? "-" : std::to_string(vcpu.core);
    const std::string r = vcpu.is_io() ? response_text(io_response_of(plan, vcpu.id))
                                       : response_text(response_of(plan, vcpu.id));
    std::string place = declared ? std::string(file_name(declared->file)) : "setup()";
    if (declared && declared->line > 0) place += ":" + std::to_string(declared->line);
    return row(runtime::vcpu_name(vcpu.id), core, text_of(vcpu.budget), text_of(vcpu.period), r, place);
}

std::string table_text(const Plan& plan, const SketchTable& table) {
    if (plan.admission().placed.empty()) return {};
    std::string out = row("VCPU", "core", "budget", "period", "R", "declared at");
    for (const sched::Vcpu& vcpu : plan.admission().placed) out += vcpu_line(plan, table, vcpu);
    return out;
}

bool costs_nothing(const sched::PlatformOverheads& o) {
    return o.release_cost == Nanoseconds{0} && o.enforcement_cost == Nanoseconds{0} && o.interferers.empty();
}

std::string overheads_text(const Plan& plan) {
    std::string out;
    for (const sched::CoreLoad& load : plan.admission().loads) {
        const sched::PlatformOverheads& o = load.overheads;
        if (costs_nothing(o)) continue;
        write(out, "  core ", load.core, ": ", text_of(o.release_cost), " per release, ",
              text_of(o.enforcement_cost), " per enforcement\n");
        for (const sched::PlatformInterferer& i : o.interferers) {
            write(out, "    ", i.name, ": ", text_of(i.cost), " every ", text_of(i.interval));
            if (i.jitter > Nanoseconds{0}) write(out, ", up to ", 1 + i.jitter / i.interval, " at once");
            if (i.peak_interval > Nanoseconds{0})
                write(out, "; in short windows every ", text_of(i.peak_interval), ", up to ",
                      1 + i.peak_jitter / i.peak_interval, " at once");
            out += '\n';
        }
    }
    if (out.empty())
        return "Counted here: the loops alone. A real computer takes time as well (to switch\n"
               "between loops, for interrupts), and R is longer there: --board FILE counts it.\n";
    return "Overheads counted, from the board file:\n" + out;
}

/// R leaves out a sleep that was not declared. Says how long such a sleep may be.
std::string sleepers_text(const Plan& plan) {
    if (!plan.admitted()) return "";
    constexpr Nanoseconds kGrain = 10us;
    std::vector<std::string> rooms;
    for (const sched::CoreLoad& load : plan.admission().loads) {
        for (const sched::Vcpu& loop : load.mains) {
            if (plan.owner_of(load.core) == loop.id) continue;
            const Nanoseconds room = plan.room_for_sleep(loop.id) / kGrain * kGrain;
            if (!rooms.empty()) rooms.back() += ',';
            rooms.push_back(runtime::vcpu_name(loop.id) +
                            (room > Nanoseconds{0} ? " " + text_of(room) : " none"));
        }
    }
    if (rooms.empty()) return "";
    rooms.back() += '.';
    return "A sleep within a release (delay()) is in R only if it is declared. Room for it:\n" +
           wrapped(rooms, "  ");
}

}  // namespace

bool all_admitted(const Plan& plan) { return plan.admitted(); }

std::string admission_text(const Plan& plan, const SketchTable& table, const CheckedBoard& board) {
    std::string out = text<std::string>(board.sketch, ": ", all_admitted(plan) ? "admitted" : "REFUSED",
                                        " on ", counted(board.cores, "core"),
                                        board.board_file.empty() ? "" : " of ", board.board_file, "\n\n");
    out += table_text(plan, table) + "\n";
    // A plan that never reached admission has its reason in the explanation alone.
    out += plan.admission().placed.empty() ? std::string(plan.explanation().view()) + "\n"
                                           : std::string(plan.admission_table().view());
    out += "\n" + overheads_text(plan) + sleepers_text(plan);
    out += board.setup_ran ? "setup() was run, with nothing wired: it may declare I/O VCPUs.\n"
                           : "setup() was not run: it calls nothing that declares an I/O VCPU.\n";
    return out;
}

std::string admission_verdict(const Plan& plan, const CheckedBoard& board, const std::string& condition) {
    const std::string on = " on " + counted(board.cores, "core");
    if (all_admitted(plan))
        return board.sketch + " is admitted" + on + ": " +
               counted(static_cast<long long>(plan.admission().placed.size()), "VCPU") + condition + ".";
    const sched::Refusal& refusal = plan.admission().refusal;
    std::string why;
    if (refusal.because != RefusedBecause::none) why = ": " + runtime::vcpu_name(refusal.vcpu.id);
    const auto* const chain = std::ranges::find_if_not(plan.chains(), &runtime::ChainVerdict::holds);
    if (chain != plan.chains().end()) why = ": chain " + std::string{chain->chain.name.view()};
    return board.sketch + " is REFUSED" + on + why + ".";
}

// ---- JSON ---------------------------------------------------------------------------------------

namespace {

Json response_json(const sched::LoopResponse& loop) {
    return endless(loop) ? Json(nullptr) : Json(loop.response.count());
}

Json core_number(int core) { return core == sched::kAnyCore ? Json(nullptr) : Json(core); }

/// Where a loop is declared; nulls for none.
Json place_json(const LoopDeclaration* declared) {
    return {{"file", declared ? Json(declared->file) : Json(nullptr)},
            {"line", declared ? Json(declared->line) : Json(nullptr)}};
}

/// What every VCPU has.
Json vcpu_json(const sched::Vcpu& vcpu) {
    return {{"id", vcpu.id},
            {"core", core_number(vcpu.core)},
            {"budget_ns", vcpu.budget.count()},
            {"period_ns", vcpu.period.count()}};
}

Json loop_json(const Plan& plan, const SketchTable& table, const sched::Vcpu& vcpu) {
    const LoopDeclaration* declared = declaration_of(table, vcpu.id);
    const sched::LoopResponse* response = response_of(plan, vcpu.id);
    Json json = vcpu_json(vcpu);
    json["response_ns"] = response ? response_json(*response) : Json(nullptr);
    json["meets"] = response ? Json(response->meets()) : Json(nullptr);
    json.update(place_json(declared));
    return json;
}

Json io_json(const Plan& plan, const sched::Vcpu& vcpu) {
    const sched::IoResponse* response = io_response_of(plan, vcpu.id);
    Json json = vcpu_json(vcpu);
    json["response_ns"] = response && !endless(*response) ? Json(response->response.count()) : Json(nullptr);
    json["replenishment_ns"] = response ? Json(response->replenishment.count()) : Json(nullptr);
    return json;
}

Json core_json(const sched::Admission& core) {
    return {{"core", core.core},
            {"admitted", core.admitted},
            {"by", core.admitted ? Json(kAdmittedBy(core.by)) : Json(nullptr)},
            {"utilisation", static_cast<double>(core.utilisation_ppm) / 1e6},
            {"bound", static_cast<double>(core.bound_ppm) / 1e6}};
}

Json overheads_json(const sched::CoreLoad& load) {
    Json interferers = Json::array();
    for (const sched::PlatformInterferer& each : load.overheads.interferers)
        interferers.push_back(interferer_json(each));
    return {{"core", load.core},
            {"release_ns", load.overheads.release_cost.count()},
            {"enforcement_ns", load.overheads.enforcement_cost.count()},
            {"interferers", interferers}};
}

Json share_json(const sched::Share& share) {
    using Kind = sched::Share::Kind;
    const bool named = share.kind == Kind::own || share.kind == Kind::main || share.kind == Kind::io;
    return {{"kind", kShares(share.kind)},
            {"id", named ? Json(share.id) : Json(nullptr)},
            {"name", share.kind == Kind::platform ? Json(share.name.view()) : Json(nullptr)},
            {"amount_ns", share.amount.count()}};
}

Json remedy_json(const sched::Refusal& refusal) {
    const sched::Remedy& remedy = refusal.remedy;
    const auto budget = remedy.budget_less_by;
    const auto period = remedy.period_more_by;
    return {
        {"budget_ns", budget ? Json((refusal.vcpu.budget - *budget).count()) : Json(nullptr)},
        {"budget_less_by_ns", budget ? Json(budget->count()) : Json(nullptr)},
        {"period_ns", period ? Json((refusal.vcpu.period + *period).count()) : Json(nullptr)},
        {"period_more_by_ns", period ? Json(period->count()) : Json(nullptr)},
        {"core", remedy.other_core ? Json(*remedy.other_core) : Json(nullptr)},
    };
}

Json refusal_json(const SketchTable& table, const sched::Refusal& refusal, int core) {
    const LoopDeclaration* declared = refusal.vcpu.is_io() ? nullptr : declaration_of(table, refusal.vcpu.id);
    const bool analysed = refusal.response.id != 0;
    Json shares = Json::array();
    for (const sched::Share& share : refusal.shares) shares.push_back(share_json(share));
    return {{"because", kRefusedBecause(refusal.because)},
            {"id", refusal.vcpu.id},
            {"io", refusal.vcpu.is_io()},
            {"core", core_number(core)},
            {"budget_ns", refusal.vcpu.budget.count()},
            {"period_ns", refusal.vcpu.period.count()},
            {"late_loop", analysed ? Json(refusal.response.id) : Json(nullptr)},
            {"response_ns", analysed ? response_json(refusal.response) : Json(nullptr)},
            {"shares", shares},
            {"smallest_change", remedy_json(refusal)},
            {"file", declared ? Json(declared->file) : Json(nullptr)},
            {"line", declared ? Json(declared->line) : Json(nullptr)}};
}

Json duration_json(Nanoseconds duration) {
    return duration > Nanoseconds{0} ? Json(duration.count()) : Json(nullptr);
}

Json chain_json(const Plan& plan, const runtime::ChainVerdict& verdict) {
    const runtime::Chain& chain = verdict.chain;
    const sched::ChainBound& bound = verdict.bound;
    const bool known = verdict.wrong.empty();
    Json stages = Json::array();
    for (std::size_t k = 0; k < chain.stages.size(); ++k) {
        const sched::ChainStage& stage = chain.stages[k];
        stages.push_back({{"id", stage.vcpu},
                          {"pass_ns", duration_json(stage.pass)},
                          {"queued", stage.queued},
                          {"reaction_step_ns", known ? Json(bound.reaction_steps[k].count()) : Json(nullptr)},
                          {"age_step_ns", known ? Json(bound.age_steps[k].count()) : Json(nullptr)},
                          {"longest_period_ns", duration_json(plan.longest_period(verdict, stage.vcpu))}});
    }
    return {{"name", chain.name.view()},
            {"from", chain.from.view()},
            {"to", chain.to.view()},
            {"stages", stages},
            {"last_ns", duration_json(bound.last)},
            {"reaction_ns", duration_json(bound.reaction)},
            {"reaction_limit_ns", duration_json(chain.limits.reaction)},
            {"age_ns", known && bound.has_age ? Json(bound.age.count()) : Json(nullptr)},
            {"age_limit_ns", duration_json(chain.limits.age)},
            {"holds", verdict.holds()},
            {"wrong", known ? Json(nullptr) : Json(verdict.wrong.view())}};
}

}  // namespace

std::string admission_json(const Plan& plan, const SketchTable& table, const CheckedBoard& board) {
    const sched::MulticoreAdmission& admission = plan.admission();
    Json loops = Json::array(), ios = Json::array(), cores = Json::array(), overheads = Json::array(),
         refusals = Json::array(), chains = Json::array();
    for (const runtime::ChainVerdict& chain : plan.chains()) chains.push_back(chain_json(plan, chain));
    for (const sched::Vcpu& vcpu : admission.placed) {
        if (vcpu.is_io()) {
            ios.push_back(io_json(plan, vcpu));
        } else {
            loops.push_back(loop_json(plan, table, vcpu));
        }
    }
    for (const sched::CoreLoad& load : admission.loads) {
        overheads.push_back(overheads_json(load));
        if (load.mains.empty() && load.ios.empty()) continue;
        cores.push_back(core_json(admission.cores[static_cast<std::size_t>(load.core)]));
    }
    if (admission.refusal.because != RefusedBecause::none) {
        refusals.push_back(refusal_json(table, admission.refusal, admission.refused_core));
    }
    const Json out{
        {"sketch", board.sketch},
        {"admitted", all_admitted(plan)},
        {"board",
         {{"cores", board.cores},
          {"file", board.board_file.empty() ? Json(nullptr) : Json(board.board_file)}}},
        {"setup_ran", board.setup_ran},
        {"loops", loops},
        {"io", ios},
        {"cores", cores},
        {"overheads", overheads},
        {"locks_that_say_nothing", board.locks_that_say_nothing},
        {"refusals", refusals},
        {"chains", chains},
        {"explanation", std::string(plan.explanation().view())},
    };
    return out.dump(2);
}

}  // namespace qduino::apps
