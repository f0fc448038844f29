#include "apps/guarantee/guarantee_report.h"

#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/terminal/human.h"
#include "apps/terminal/wrap.h"

namespace qduino::apps {
namespace {

using Json = nlohmann::ordered_json;

double microseconds(Nanoseconds duration) { return static_cast<double>(duration.count()) / 1000.0; }

const char* yes_no(bool yes) { return yes ? "yes" : "NO"; }

/// A remark below its line; nothing when `text` is empty.
std::string remark(std::string_view text) { return text.empty() ? "" : wrapped(text, "         "); }

std::string loop_line(const board::LoopGuarantee& loop) {
    char text[120];
    std::snprintf(text, sizeof text, "  %-4u %-4d %9s / %-9s    %-9s %-9s %s\n",
                  static_cast<unsigned>(loop.id), loop.core, human_duration(loop.budget).c_str(),
                  human_duration(loop.period).c_str(), yes_no(loop.priority_enforced),
                  yes_no(loop.budget_enforced), loop.core_owned ? "owned" : "shared");
    return text + remark(loop.shortfall);
}

std::string core_line(const board::CoreGuarantee& core) {
    std::string out = "  core " + std::to_string(core.core) + ":";
    char text[80];
    if (core.interrupts_per_second >= 0) {
        std::snprintf(text, sizeof text, " %.0f interrupts/s,", core.interrupts_per_second);
        out += text;
    }
    if (core.worst_gap.count() >= 0) {
        out += " worst gap of a bare spin " + human_duration(core.worst_gap) + ",";
    }
    out += core.tick_stopped ? " no tick," : " tick,";
    out += core.throttling_lifted ? " no throttling\n" : " RT throttling\n";
    return out + remark(core.note);
}

}  // namespace

std::string guarantee_text(const board::GuaranteeReport& report) {
    std::string out = "What holds on this board (" + std::string(report.board.view()) + ", memory " +
                      (report.memory_locked ? "locked" : "NOT locked") + "):\n";
    out += "  loop core    budget / period       priority  budget    core\n";
    for (const board::LoopGuarantee& loop : report.loops) out += loop_line(loop);
    for (const board::CoreGuarantee& core : report.cores) out += core_line(core);
    return out;
}

std::string guarantee_json(const board::GuaranteeReport& report) {
    Json loops = Json::array();
    for (const board::LoopGuarantee& loop : report.loops) {
        loops.push_back({{"id", loop.id},
                         {"core", loop.core},
                         {"budget_us", microseconds(loop.budget)},
                         {"period_us", microseconds(loop.period)},
                         {"priority_enforced", loop.priority_enforced},
                         {"budget_enforced", loop.budget_enforced},
                         {"core_owned", loop.core_owned},
                         {"shortfall", std::string(loop.shortfall.view())}});
    }
    Json cores = Json::array();
    for (const board::CoreGuarantee& core : report.cores) {
        const bool counted = core.interrupts_per_second >= 0;
        const bool spun = core.worst_gap.count() >= 0;
        cores.push_back(
            {{"core", core.core},
             {"interrupts_per_second", counted ? Json(core.interrupts_per_second) : Json(nullptr)},
             {"worst_gap_us", spun ? Json(microseconds(core.worst_gap)) : Json(nullptr)},
             {"tick_stopped", core.tick_stopped},
             {"throttling_lifted", core.throttling_lifted},
             {"note", std::string(core.note.view())}});
    }
    const Json out{{"board", std::string(report.board.view())},
                   {"simulated", report.simulated},
                   {"memory_locked", report.memory_locked},
                   {"loops", loops},
                   {"cores", cores}};
    return out.dump();
}

}  // namespace qduino::apps
