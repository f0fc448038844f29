#include "report/guarantee_report.h"

#include <nlohmann/json.hpp>
#include <string>

#include "base/text.h"
#include "base/words.h"
#include "posix/durable_file.h"

namespace qduino::apps {
namespace {

using Json = nlohmann::ordered_json;

double microseconds(Nanoseconds duration) { return static_cast<double>(duration.count()) / 1000.0; }

Json measured(Nanoseconds duration) {
    return duration < Nanoseconds{0} ? Json(nullptr) : Json(microseconds(duration));
}

/// Names and reasons may come from other programs: bytes that are no UTF-8 become U+FFFD.
std::string text_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

Json json_of(const board::TreeGuarantee& tree) {
    return {{"name", tree.name.view()},
            {"core", tree.core},
            {"budget_us", microseconds(tree.budget)},
            {"period_us", microseconds(tree.period)},
            {"admitted", tree.admitted},
            {"response_us", tree.admitted ? Json(microseconds(tree.response)) : Json(nullptr)},
            {"enforced", tree.enforced},
            {"shortfall", tree.shortfall.view()}};
}

Json json_of(const board::BottomHalfGuarantee& half) {
    return {{"id", half.id},
            {"core", half.core},
            {"timed", half.timed},
            {"untimed", half.untimed},
            {"begin_p50_us", microseconds(half.begin_median)},
            {"begin_p999_us", microseconds(half.begin_p999)},
            {"begin_worst_us", microseconds(half.begin_worst)},
            {"end_worst_us", microseconds(half.end_worst)},
            {"response_us", measured(half.response)},
            {"replenishment_us", measured(half.replenishment)}};
}

constexpr Words<board::DelayCause::tasks, board::DelayCause::quota> kCauseNames{
    "tasks", "host", "interrupts", "charged", "work", "unseen", "untold", "stopped", "quota"};

Json json_of(const board::DelayGuarantee& delay) {
    Json json{{"id", delay.id},
              {"core", delay.core},
              {"worst_us", microseconds(delay.worst)},
              {"at_s", to_seconds(delay.at)},
              {"window_s", to_seconds(delay.window)},
              {"host_us", measured(delay.host)},
              {"tasks_us", measured(delay.tasks)},
              {"interrupted_us", measured(delay.interrupted)},
              {"interrupts", delay.interrupts < 0 ? Json(nullptr) : Json(delay.interrupts)},
              {"most", delay.most.view()},
              {"throttled", delay.throttled < 0 ? Json(nullptr) : Json(delay.throttled)},
              {"beyond_us", microseconds(delay.beyond)},
              {"stopped_us", microseconds(delay.stopped)},
              {"quota_us", microseconds(delay.quota)}};
    json["cause"] = kCauseNames(cause_of(delay));
    for (std::size_t i = 0; i < delay.late.size(); ++i)
        json[text<std::string>("late_", kCauseNames(static_cast<board::DelayCause>(i)))] = delay.late[i];
    return json;
}

Json json_of(const board::LoopGuarantee& loop) {
    const bool counted = loop.releases >= 0;
    const auto count = [counted](std::int64_t number) { return counted ? Json(number) : Json(nullptr); };
    return {{"id", loop.id},
            {"core", loop.core},
            {"budget_us", microseconds(loop.budget)},
            {"period_us", microseconds(loop.period)},
            {"priority_enforced", loop.priority_enforced},
            {"budget_enforced", loop.budget_enforced},
            {"core_owned", loop.core_owned},
            {"shortfall", loop.shortfall.view()},
            {"cpu_used_us", measured(loop.used)},
            {"watched_us", measured(loop.used < Nanoseconds{0} ? loop.used : loop.watched)},
            {"held_from_outside", loop.held},
            {"escape", loop.escape.view()},
            {"taken", loop.taken.view()},
            {"kernel_threads", loop.kernel_threads},
            {"kernel_cpu_us", measured(loop.kernel_used)},
            {"kernel_held", loop.kernel_held},
            {"releases", count(loop.releases)},
            {"overruns", count(loop.overruns)},
            {"dropped", count(loop.dropped)},
            {"missed", count(loop.missed)},
            {"worst_late_us", counted ? Json(microseconds(loop.worst_late)) : Json(nullptr)}};
}

Json json_of(const board::CoreGuarantee& core) {
    const bool counted = core.interrupts_per_second >= 0;
    const bool admitted = core.counted_per_second >= 0;
    return {{"core", core.core},
            {"interrupts_per_second", counted ? Json(core.interrupts_per_second) : Json(nullptr)},
            {"worst_gap_us", measured(core.worst_gap)},
            {"counted_per_second", admitted ? Json(core.counted_per_second) : Json(nullptr)},
            {"counted_us", admitted ? Json(microseconds(core.counted_cost)) : Json(nullptr)},
            {"counted_share", admitted ? Json(core.counted_share) : Json(nullptr)},
            {"counted_at_once_us", admitted ? Json(microseconds(core.counted_at_once)) : Json(nullptr)},
            {"tick_stopped", core.tick_stopped},
            {"throttling_lifted", core.throttling_lifted},
            {"note", core.note.view()}};
}

Json json_of(const board::ChainGuarantee& chain) {
    const auto if_any = [](bool any, Nanoseconds duration) {
        return any ? Json(microseconds(duration)) : Json(nullptr);
    };
    const bool has_age = chain.age_bound >= Nanoseconds{0};
    return {{"name", chain.name.view()},
            {"way", chain.way.view()},
            {"reaction_bound_us", microseconds(chain.reaction_bound)},
            {"reaction_limit_us", if_any(chain.reaction_limit > Nanoseconds{0}, chain.reaction_limit)},
            {"age_bound_us", measured(chain.age_bound)},
            {"age_limit_us", if_any(chain.age_limit > Nanoseconds{0}, chain.age_limit)},
            {"reactions", chain.reactions},
            {"worst_reaction_us", if_any(chain.reactions > 0, chain.worst_reaction)},
            {"worst_age_us", if_any(has_age && chain.worst_age > Nanoseconds{0}, chain.worst_age)},
            {"from_first_loop", chain.from_first_loop}};
}

/// A list of what json_of() makes of each.
Json list_of(const auto& pieces) {
    Json list = Json::array();
    for (const auto& piece : pieces) list.push_back(json_of(piece));
    return list;
}

}  // namespace

std::string tree_json(const board::TreeGuarantee& tree) { return text_of(json_of(tree)); }

std::string guarantee_json(const board::GuaranteeReport& report) {
    const Json out{{"board", report.board.view()},
                   {"simulated", report.simulated},
                   {"memory_locked", report.memory_locked},
                   {"watch_cost_us", measured(report.watch_cost)},
                   {"strange_threads", report.strange_threads},
                   {"ran_us", measured(report.ran)},
                   {"watch_lost", report.watch_lost.view()},
                   {"intruders", report.intruders.view()},
                   {"loops", list_of(report.loops)},
                   {"cores", list_of(report.cores)},
                   {"bottom_halves", list_of(report.bottom_halves)},
                   {"delays", list_of(report.delays)},
                   {"trees", list_of(report.trees)},
                   {"chains", list_of(report.chains)}};
    return text_of(out);
}

Result<void> write_guarantee(const board::GuaranteeReport& report, const std::string& path) {
    if (posix::write_durably(path, guarantee_json(report) + '\n', 0666)) return {};
    return make_error(ErrorCode::unavailable, "the guarantee report cannot be written to ", path,
                      ": check that its folder is there and yours");
}

}  // namespace qduino::apps
