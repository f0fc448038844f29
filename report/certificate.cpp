#include "report/certificate.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/contract.h"
#include "base/sha256.h"
#include "posix/small_file.h"
#include "report/interferer_json.h"

namespace qduino::apps {
namespace {

using Json = nlohmann::ordered_json;

Json budget_claim(const sched::Vcpu& vcpu) {
    return {{"id", vcpu.id}, {"budget_ns", vcpu.budget.count()}, {"period_ns", vcpu.period.count()}};
}

Json io_claim(const sched::Vcpu& io) {
    Json claim = budget_claim(io);
    claim["client_period_ns"] = io.client_period.count();
    claim["edge_ns"] = io.edge_cost.count();
    claim["edge_interval_ns"] = io.edge_interval.count();
    return claim;
}

Json loop_claim(const sched::Vcpu& loop, const sched::CoreLoad& load, const sched::Admission& admission) {
    const auto* const verdict = std::ranges::find(admission.loops, loop.id, &sched::LoopResponse::id);
    QDUINO_EXPECT(verdict != admission.loops.end());
    Json claim = budget_claim(loop);
    claim["suspension_ns"] = loop.suspension.count();
    claim["sleeps"] = loop.sleeps;
    claim["deferrable"] = loop.deferrable;
    claim["longest_wait_ns"] = load.waits_of(loop.id).longest.count();
    claim["response_ns"] = verdict->response.count();
    return claim;
}

Json core_claim(const sched::CoreLoad& load, const sched::Admission& admission) {
    Json loops = Json::array(), ios = Json::array(), interferers = Json::array(), sections = Json::array();
    for (const sched::Vcpu& loop : load.mains) loops.push_back(loop_claim(loop, load, admission));
    for (const sched::Vcpu& io : load.ios) ios.push_back(io_claim(io));
    for (const sched::PlatformInterferer& each : load.overheads.interferers)
        interferers.push_back(interferer_json(each));
    for (const sched::CriticalSection& section : load.sections) {
        const bool is_here = std::ranges::count(load.mains, section.loop, &sched::Vcpu::id) > 0 ||
                             std::ranges::count(load.ios, section.loop, &sched::Vcpu::id) > 0;
        if (!is_here) continue;
        sections.push_back({{"vcpu", section.loop},
                            {"lock", section.lock},
                            {"length_ns", section.length.count()},
                            {"assumed", section.assumed}});
    }
    return {{"core", load.core},
            {"owned", admission.by == sched::AdmittedBy::owned},
            {"priorities", load.overheads.priorities},
            {"activation_ns", load.overheads.per_activation().count()},
            {"wait_ns", load.overheads.wait_cost.count()},
            {"wake_ns", load.overheads.wake_latency.count()},
            {"victim_pays", load.overheads.victim_pays},
            {"kept_ns", load.overheads.kept_budget.count()},
            {"kept_period_ns", load.overheads.kept_period.count()},
            {"interferers", interferers},
            {"sections", sections},
            {"ios", ios},
            {"loops", loops}};
}

Json chain_claim(const runtime::ChainVerdict& verdict, const sched::MulticoreAdmission& admission) {
    Json stages = Json::array();
    for (const sched::ChainStage& stage : verdict.chain.stages) {
        Json claim{{"id", stage.vcpu}, {"pass_ns", stage.pass.count()}, {"queued", stage.queued}};
        for (const sched::Admission& core : admission.cores) {
            const auto* const io = std::ranges::find(core.ios, stage.vcpu, &sched::IoResponse::id);
            if (io == core.ios.end()) continue;
            claim["response_ns"] = io->response.count();
            claim["replenishment_ns"] = io->replenishment.count();
        }
        stages.push_back(claim);
    }
    return {{"name", verdict.chain.name.view()},
            {"stages", stages},
            {"reaction_ns", verdict.bound.reaction.count()},
            {"age_ns", verdict.bound.has_age ? Json(verdict.bound.age.count()) : Json(nullptr)},
            {"reaction_limit_ns", verdict.chain.limits.reaction.count()},
            {"age_limit_ns", verdict.chain.limits.age.count()}};
}

std::string hash_of(const std::string& text) {
    BareSha256 hash;
    hash.add(text);
    return hash.finish();
}

Result<Json> text_claim(const std::filesystem::path& file) {
    QDUINO_TRY_ASSIGN(const std::string text, posix::read_small_file(file));
    return Json{{"file", file.filename().string()}, {"sha256", hash_of(text)}};
}

}  // namespace

Result<std::string> certificate_json(const runtime::Plan& plan, const CertifiedTexts& texts) {
    QDUINO_EXPECT(plan.admitted());
    const sched::MulticoreAdmission& admission = plan.admission();
    Json cores = Json::array();
    for (const sched::CoreLoad& load : admission.loads) {
        if (load.mains.empty() && load.ios.empty()) continue;
        cores.push_back(core_claim(load, admission.cores[static_cast<std::size_t>(load.core)]));
    }
    Json sources = Json::array(), board = nullptr;
    for (const std::filesystem::path& source : texts.sources) {
        QDUINO_TRY_ASSIGN(Json claim, text_claim(source));
        sources.push_back(std::move(claim));
    }
    if (!texts.board.empty()) {
        QDUINO_TRY_ASSIGN(board, text_claim(texts.board));
    }
    Json chains = Json::array();
    for (const runtime::ChainVerdict& chain : plan.chains()) chains.push_back(chain_claim(chain, admission));
    Json out{{"certificate", 3},
             {"sketch", texts.sketch},
             {"sources", sources},
             {"board", board},
             {"locks_that_say_nothing", texts.locks_that_say_nothing},
             {"cores", cores},
             {"chains", chains}};
    out["sha256"] = hash_of(out.dump());
    return out.dump(2) + "\n";
}

}  // namespace qduino::apps
