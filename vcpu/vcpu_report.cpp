#include "vcpu/vcpu_report.h"

#include <nlohmann/json.hpp>

#include "base/text.h"
#include "report/guarantee_report.h"
#include "terminal/human.h"

namespace qduino::apps {
namespace {

double microseconds_in(Nanoseconds duration) { return static_cast<double>(duration.count()) / 1000.0; }

std::string percent(double share) { return text<std::string>(Fixed{share * 100, 1}, " %"); }

}  // namespace

double share_of(Nanoseconds used, Nanoseconds lasted) {
    return lasted.count() > 0 ? static_cast<double>(used.count()) / static_cast<double>(lasted.count()) : 0;
}

board::TreeGuarantee guarantee_of(const ProcessVcpu& vcpu) {
    board::TreeGuarantee line;
    line.name = decltype(line.name){vcpu.tree().name};
    line.core = vcpu.tree().core;
    line.budget = vcpu.tree().budget;
    line.period = vcpu.tree().period;
    line.admitted = vcpu.verdict().admitted;
    line.response = vcpu.verdict().response;
    line.enforced = vcpu.active();
    line.shortfall = decltype(line.shortfall){vcpu.verdict().refusal};
    return line;
}

std::string use_text(const board::linux::TreeVcpu& tree, const board::linux::CpuGroupUse& use,
                     Nanoseconds lasted) {
    auto out = text<std::string>(human_duration(use.used), " of CPU time in ", human_duration(lasted));
    // Within a period it may take the budget at once: a share says nothing.
    if (lasted >= tree.period) {
        write(out, ", ", percent(share_of(use.used, lasted)), " of a core, of ",
              percent(share_of(tree.budget, tree.period)), " promised");
    }
    return write(out, "; throttled in ", use.throttled, " of ", counted(use.periods, "period"));
}

std::string vcpu_json(const board::TreeGuarantee& guarantee, const char* enforced_by,
                      const board::linux::CpuGroupUse& use, Nanoseconds lasted, double used_share) {
    using Json = nlohmann::ordered_json;
    Json out = Json::parse(tree_json(guarantee));
    out["enforced_by"] = guarantee.enforced ? Json(enforced_by) : Json(nullptr);
    out["used_us"] = microseconds_in(use.used);
    out["lasted_us"] = microseconds_in(lasted);
    out["used_share"] = used_share;
    out["periods"] = use.periods;
    out["throttled"] = use.throttled;
    out["throttled_us"] = microseconds_in(use.throttled_for);
    return out.dump();
}

}  // namespace qduino::apps
