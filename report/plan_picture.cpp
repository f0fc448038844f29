#include "report/plan_picture.h"

#include <algorithm>
#include <iterator>

#include "base/text.h"
#include "report/picture/critical_instant.h"

namespace qduino::apps {
namespace {

using runtime::Plan;

/// The VCPUs that admission has put on a core, or has tried there.
std::vector<sched::Vcpu> placed(const Plan& plan) {
    std::vector<sched::Vcpu> found;
    for (const sched::Vcpu& vcpu : plan.admission().placed) {
        if (vcpu.core >= 0 && vcpu.parameters().valid()) found.push_back(vcpu);
    }
    return found;
}

sched::PlatformOverheads overheads_of(const Plan& plan, int core) {
    for (const sched::CoreLoad& load : plan.admission().loads) {
        if (load.core == core) return load.overheads;
    }
    return {};
}

}  // namespace

void declare_rows(const Plan& plan, picture::Recorder& recorder) {
    for (const board::VcpuSpec& vcpu : plan.specs()) recorder.declare(vcpu, vcpu.owns_core);
}

std::vector<picture::Response> responses_of(const Plan& plan) {
    std::vector<picture::Response> responses;
    for (const sched::Vcpu& vcpu : plan.admission().placed) {
        if (vcpu.is_io()) continue;
        for (const sched::Admission& core : plan.admission().cores) {
            const auto* const found = std::ranges::find(core.loops, vcpu.id, &sched::LoopResponse::id);
            if (found == core.loops.end()) continue;
            const bool never = found->response > sched::kResponseLimit * found->period;
            responses.push_back({.name = picture::row_name(vcpu.id),
                                 .budget = vcpu.budget,
                                 .period = vcpu.period,
                                 .worst = never ? std::nullopt : std::optional(found->response),
                                 .seen = {}});
            break;
        }
    }
    return responses;
}

void add_seen(const picture::Schedule& schedule, std::vector<picture::Response>& responses) {
    for (const picture::Core& core : schedule.cores) {
        for (const picture::Row& row : core.rows) {
            const auto found = std::ranges::find(responses, row.name, &picture::Response::name);
            if (found != responses.end()) found->seen = row.worst_response;
        }
    }
}

Nanoseconds length_for(const Plan& plan, const PictureWindow& window) {
    if (window.length_s) return from_seconds(*window.length_s);
    return picture::good_length(placed(plan));
}

std::int64_t periods_until_end(const Plan& plan, const PictureWindow& window) {
    Nanoseconds shortest = Nanoseconds::max();
    for (const sched::Vcpu& vcpu : placed(plan)) shortest = std::min(shortest, vcpu.period);
    return (from_seconds(window.from_s) + length_for(plan, window)) / shortest;
}

picture::Schedule critical_schedule(const Plan& plan, const std::string& sketch,
                                    const PictureWindow& window) {
    const Instant from = kEpoch + from_seconds(window.from_s);
    const Instant until = from + std::max(length_for(plan, window), Nanoseconds{1});
    const std::vector<sched::Vcpu> vcpus = placed(plan);
    picture::Recorder recorder(from, until);
    for (int core = 0; core < static_cast<int>(sched::kCoreLimit); ++core) {
        std::vector<sched::Vcpu> here;
        std::ranges::copy_if(vcpus, std::back_inserter(here),
                             [core](const sched::Vcpu& v) { return v.core == core; });
        if (here.empty()) continue;
        picture::record_critical_instant(here, overheads_of(plan, core), plan.owner_of(core), until,
                                         recorder);
    }
    picture::Schedule schedule = recorder.finish(until);
    schedule.title = sketch + ": the worst that admission counts with";
    schedule.remark =
        "All loops are released together at 0, each wants its whole budget in every period, and what the "
        "platform "
        "takes comes as early as it may. I/O VCPUs always have work. R also counts what is not drawn: waits "
        "for locks, "
        "sleeps, and two budgets of a loop in close succession.";
    schedule.responses = responses_of(plan);
    return schedule;
}

}  // namespace qduino::apps
