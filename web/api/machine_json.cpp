#include "web/api/machine_json.h"

#include "base/words.h"

namespace qduino::web::api {

using printer::link::HeaterStatus;
using printer::link::MachineState;
using printer::link::MotionStatus;

namespace {

Json heater_status_json(const HeaterStatus& heater) {
    return {{"c", heater.celsius},
            {"reading", heater.reading},
            {"target_c", heater.target_celsius},
            {"duty", heater.duty},
            {"fault", heater.fault}};
}

Json lateness_json(const Histogram& lateness_ns) {
    Json buckets = Json::array();
    for (int i = 0; i < Histogram::kBuckets; ++i) {
        if (lateness_ns.bucket_count(i) > 0) {
            buckets.push_back({Histogram::upper_bound_of(i), lateness_ns.bucket_count(i)});
        }
    }
    return {{"p50", lateness_ns.quantile(0.5)},      {"p99", lateness_ns.quantile(0.99)},
            {"p9999", lateness_ns.quantile(0.9999)}, {"max", lateness_ns.max()},
            {"count", lateness_ns.count()},          {"buckets", std::move(buckets)}};
}

Json timing_json(const MotionStatus& motion) {
    return {{"late_steps", motion.late_steps}, {"shift_ns", motion.shift_ns},
            {"starved", motion.starved},       {"ring_fill", motion.ring_fill},
            {"pulses", motion.pulses},         {"lateness_ns", lateness_json(motion.lateness_ns)}};
}

Json facts_of(const spool::Job& job) {
    Json facts = Json::parse(job.facts_json, nullptr, false);
    if (!facts.is_object()) facts = Json::object();
    if (!facts.contains("thumbnail")) facts["thumbnail"] = job.has_thumbnail;
    facts.erase("profile");  // the service's own (eta.h)
    return facts;
}

}  // namespace

std::string text_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

Response json_response(const Json& json, int status) { return {.status = status, .body = text_of(json)}; }

std::optional<Json> object_of(std::string_view body) {
    Json json = Json::parse(body, nullptr, false);
    if (!json.is_object()) return std::nullopt;
    return json;
}

Json text_or_null(std::string_view text) { return text.empty() ? Json{} : Json(text); }

std::string_view machine_word(MachineState state) {
    static constexpr Words<MachineState::starting, MachineState::faulted> kWords{
        "starting", "idle", "printing", "pausing", "paused", "cancelling", "faulted"};
    return kWords(state);
}

Json activity_word(printer::link::Activity activity) {
    using enum printer::link::Activity;
    switch (activity) {
        case none:
            break;
        case homing:
            return "homing";
        case probing:
            return "probing";
        case heating_hot_end:
            return "heating_hot_end";
        case heating_bed:
            return "heating_bed";
        case returning:
            return "returning";
    }
    return nullptr;
}

Json progress_json(const Progress& progress) {
    return {{"bytes", progress.bytes},
            {"fraction", progress.fraction},
            {"elapsed_s", progress.elapsed_s},
            {"remaining_s", progress.remaining_s}};
}

Json job_json(const spool::Job& job, std::string_view word, const Progress& progress) {
    return {
        {"id", job.id},
        {"name", job.name},
        {"size", job.size},
        {"sha256", job.sha256},
        {"state", word},
        {"hold", job.hold},
        {"copies", job.copies},
        {"copies_done", job.copies_done},
        {"priority", job.priority},
        {"position", nullptr},
        {"starts_in_s", nullptr},
        {"created", nullptr},
        {"started", nullptr},
        {"ended", nullptr},
        {"error", text_or_null(job.error)},
        {"stopped_line", job.stopped_line},
        {"stopped_layer", job.stopped_layer},
        {"stopped_byte", job.stopped_byte},
        {"printed_s", job.printed_s},
        {"facts", facts_of(job)},
        {"progress", progress_json(progress)},
    };
}

Json machine_json(const printer::link::JobStatus& job, const MotionStatus& motion,
                  const printer::link::HeatStatus& heat) {
    return {
        {"message", job.message.view()},
        {"position_mm",
         {{"x", job.position_mm[0]},
          {"y", job.position_mm[1]},
          {"z", job.position_mm[2]},
          {"e", job.position_mm[3]}}},
        {"homed", job.homed},
        {"hot_end", heater_status_json(heat.hot_end)},
        {"bed", heater_status_json(heat.bed)},
        {"fan", heat.fan_duty},
        {"idle_off_in_s", heat.idle_left_s >= 0 ? Json(heat.idle_left_s) : Json{}},
        {"idle_timed_out", heat.idle_timed_out},
        {"idle_timeout_s", heat.idle_timeout_s},
        {"parked", job.parked && job.state == MachineState::paused},
        {"feed_factor", job.feed_factor},
        {"flow_factor", job.flow_factor},
        {"activity", activity_word(job.activity)},
        {"layer", job.layer},
        {"line", job.line},
        {"bytes_executed", job.bytes_executed},
        {"bytes_accepted", job.bytes_accepted},
        {"print_time_s", job.print_time_s},
        {"timing", timing_json(motion)},
    };
}

}  // namespace qduino::web::api
