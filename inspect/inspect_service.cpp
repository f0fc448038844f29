#include "inspect/inspect_service.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "inspect/prefetch_source.h"
#include "twin/fault.h"
#include "twin/report.h"

namespace qduino::apps {
namespace {

using Json = nlohmann::ordered_json;

// Text from outside may not be UTF-8; an answer always is.
std::string to_line(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

std::string refusal(std::string_view why) { return to_line({{"ok", false}, {"error", why}}); }

std::string text_of(const Json& request, const char* key) {
    const auto found = request.find(key);
    return found != request.end() && found->is_string() ? found->get<std::string>() : std::string{};
}

// 0 when it is not given.
std::uint64_t count_of(const Json& request, const char* key) {
    const auto found = request.find(key);
    return found != request.end() && found->is_number_unsigned() ? found->get<std::uint64_t>() : 0;
}

// A length that no line of a job is longer than; else none.
double length_of(const Json& request, const char* key) {
    const auto found = request.find(key);
    const double mm = found != request.end() && found->is_number() ? found->get<double>() : 0;
    return std::abs(mm) < 1e6 ? mm : 0;
}

// A job's id as one string: 7 and "7" stay different.
std::string id_of(const Json& request) {
    const auto found = request.find("job");
    if (found == request.end() || !(found->is_string() || found->is_number_integer())) return {};
    return to_line(*found);
}

template <typename Values>
Json by_axis(const Values& values) {
    Json json;
    for (std::size_t axis = 0; axis < values.size(); ++axis)
        json[std::string(1, static_cast<char>(twin::kAxisLetter[axis] | 0x20))] = values[axis];
    return json;
}

Json heater_json(const twin::PrinterState& state, std::size_t heater) {
    return {{"c", state.celsius[heater]},
            {"block_c", state.block_celsius[heater]},
            {"duty", state.heater_duty[heater]},
            {"off_since_s", to_seconds(state.heater_off_since[heater].time_since_epoch())}};
}

}  // namespace

InspectService::InspectService(twin::Printer& printer, std::function<Instant()> drain)
    : printer_(printer), drain_(std::move(drain)) {}

std::string InspectService::answer(std::string_view line) {
    const Json request = Json::parse(line, nullptr, false);
    if (!request.is_object()) return refusal("a request is one JSON object on one line");
    const std::string op = text_of(request, "op");
    if (op == "state") return state();
    if (op == "fault") return fault(text_of(request, "fault"));
    if (op == "clear_faults") {
        printer_.clear_faults(drain_());
        return to_line({{"ok", true}});
    }
    if (op != "job_begin" && op != "job_end" && op != "job_typed")
        return refusal("known are op: job_begin, job_typed, job_end, state, fault, clear_faults");
    const std::string job = id_of(request);
    if (job.empty()) return refusal("job: a string or a whole number is needed");
    if (op == "job_begin") return begin(job, text_of(request, "path"));
    if (op == "job_typed") {
        return typed(job, count_of(request, "number"), count_of(request, "behind_line"),
                     length_of(request, "left_mm"), text_of(request, "line"));
    }
    return end(job, count_of(request, "excursions"));
}

std::string InspectService::typed(const std::string& job, std::uint64_t number, std::uint64_t behind_line,
                                  double left_mm, const std::string& line) {
    if (!job_ || job_id_ != job) return refusal("this job is not being watched");
    if (number >= typed_) {
        job_->on_typed(behind_line, line, left_mm);
        typed_ = number + 1;
    }
    return to_line({{"ok", true}});
}

std::string InspectService::begin(const std::string& job, const std::string& path) {
    if (job_ && job_id_ == job) return to_line({{"ok", true}, {"already", true}});
    auto source = std::make_unique<PrefetchSource>(path);
    if (!source->ok()) return refusal("path: the file cannot be read");
    end_watch(0);
    const Instant now = drain_();
    job_ = std::make_unique<twin::Job>(printer_, std::move(source), now, last_place_);
    job_id_ = job;
    typed_ = 0;
    return to_line({{"ok", true}, {"already", false}});
}

std::string InspectService::end(const std::string& job, std::uint64_t excursions_told) {
    if (job_ && job_id_ == job) end_watch(excursions_told);
    const auto ended = std::ranges::find(ended_, job, &Ended::job);
    if (ended == ended_.end()) return refusal("no such job is or was watched");
    return R"({"ok":true,"report":)" + ended->report + "}";
}

void InspectService::end_watch(std::uint64_t excursions_told) {
    if (!job_) return;
    // Does not read the rest of a job that was cut short: the machine cannot wait for a disk.
    const twin::Report report = job_->finish(drain_(), false, excursions_told);
    last_place_ = job_->next_start();
    job_.reset();
    std::erase_if(ended_, [&](const Ended& ended) { return ended.job == job_id_; });
    ended_.push_back({job_id_, twin::to_json(report)});
    if (ended_.size() > kReportsKept) ended_.pop_front();
}

std::string InspectService::state() {
    const Instant now = drain_();
    const twin::PrinterState state = printer_.state(now);
    std::array<std::uint64_t, twin::kAxisCount> lost{}, moved{};
    for (std::size_t axis = 0; axis < lost.size(); ++axis) {
        lost[axis] = state.counters[axis].lost();
        moved[axis] = state.counters[axis].moved;
    }
    Json json;
    json["ok"] = true;
    json["time_s"] = to_seconds(now.time_since_epoch());
    json["position_mm"] = by_axis(state.position_mm);
    json["position_steps"] = by_axis(state.position_steps);
    json["steps"] = by_axis(moved);
    json["lost_steps"] = by_axis(lost);
    json["motors_enabled"] = by_axis(state.enabled);
    json["endstops"] = by_axis(state.pressed);
    json["hot_end"] = heater_json(state, twin::kHotEnd);
    json["bed"] = heater_json(state, twin::kBed);
    json["fan_duty"] = state.fan_duty;
    json["timing_violations"] = state.timing_violations;
    json["conversions"] = state.conversions;
    json["job"] = job_ ? Json::parse(job_id_) : Json(nullptr);
    json["line"] = job_ ? Json(job_->line()) : Json(nullptr);
    return to_line(json);
}

std::string InspectService::fault(const std::string& text) {
    Result<twin::Fault> fault = twin::parse_fault(text);
    if (!fault) return refusal(fault.error().message);
    fault->at = drain_() + fault->at.time_since_epoch();
    printer_.inject(*fault);
    return to_line({{"ok", true}});
}

Result<std::unique_ptr<InspectServer>> serve_inspector(const std::string& path, InspectService& service) {
    if (path.empty()) return std::unique_ptr<InspectServer>{};
    const auto answer = [&service](std::string_view request) { return service.answer(request); };
    QDUINO_TRY_ASSIGN(InspectServer server, InspectServer::listen(path, answer));
    return std::make_unique<InspectServer>(std::move(server));
}

}  // namespace qduino::apps
