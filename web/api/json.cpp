#include "web/api/json.h"

#include <algorithm>
#include <cmath>

#include "base/words.h"
#include "web/api/eta.h"

namespace qduino::web::api {

using printer::link::HeaterStatus;
using printer::link::MachineState;
using printer::link::MotionStatus;

namespace {

Json heater_json(const HeaterStatus& heater) {
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

Json text_or_null(std::string_view text) { return text.empty() ? Json{} : Json(text); }

/// The fault that stops the machine; null when there is none.
Json fault_json(const spool::MachineView& machine) {
    if (!machine.death_note.empty()) return machine.death_note;
    if (machine.life == spool::SketchLife::died) return "the machine's program has died";
    if (machine.life == spool::SketchLife::hung) return "the machine's program hangs";
    if (!machine.responding) return "the machine does not answer";
    if (machine.job.state == MachineState::faulted) {
        return machine.job.fault.empty() ? machine.heat.fault.view() : machine.job.fault.view();
    }
    return text_or_null(machine.heat.fault);
}

std::string hexadecimal(std::uint64_t value) {
    std::string digits;
    write_characters(digits, value, 16);
    return digits.insert(0, 16 - digits.size(), '0');
}

Json facts_json(const spool::Job& job) {
    Json facts = Json::parse(job.facts_json, nullptr, false);
    if (!facts.is_object()) facts = Json::object();
    if (!facts.contains("thumbnail")) facts["thumbnail"] = job.has_thumbnail;
    facts.erase("profile");  // the service's own (eta.h)
    return facts;
}

/// The time left for all copies of `job`, the running one included; nothing when it is unknown.
std::optional<double> remaining_of(const spool::Spool& spool, const spool::Job& job) {
    const bool printing = job.state == spool::JobState::printing;
    const int whole_copies = std::max(0, job.copies - job.copies_done - (printing ? 1 : 0));
    if (whole_copies > 0 && job.estimated_s <= 0) return std::nullopt;
    const std::optional<double> running = printing ? progress_of(spool, job).remaining_s : 0.0;
    return running ? std::optional{*running + job.estimated_s * whole_copies} : std::nullopt;
}

Json progress_json(const Progress& progress) {
    return {{"bytes", progress.bytes},
            {"fraction", progress.fraction},
            {"elapsed_s", progress.elapsed_s},
            {"remaining_s", progress.remaining_s}};
}

Json gate_json(const spool::Spool& spool) {
    const spool::QueueGate& gate = spool.gate();
    return {{"held", !gate.hold_reason.empty()},
            {"reason", text_or_null(gate.hold_reason)},
            {"bed_occupied", gate.bed_occupied},
            {"confirm_bed", spool.confirms_bed()}};
}

}  // namespace

std::string text_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

Response json_response(const Json& json, int status) { return {.status = status, .body = text_of(json)}; }

std::optional<Json> object_of(std::string_view body) {
    Json json = Json::parse(body, nullptr, false);
    if (!json.is_object()) return std::nullopt;
    return json;
}

std::optional<std::string> text_member(std::string_view body, const char* name) {
    const Json json = Json::parse(body, nullptr, false);
    if (!json.is_object() || !json.contains(name) || !json[name].is_string()) return std::nullopt;
    return json[name].get<std::string>();
}

Json time_json(spool::UnixSeconds time_s) {
    if (time_s == 0) return nullptr;
    return spool::utc_text(time_s, "%Y-%m-%dT%H:%M:%SZ");
}

std::string_view machine_word(const spool::MachineView& machine) {
    if (!machine.connected || machine.life != spool::SketchLife::alive || !machine.responding)
        return "disconnected";
    static constexpr Words<MachineState::starting, MachineState::faulted> kWords{
        "starting", "idle", "printing", "pausing", "paused", "cancelling", "faulted"};
    return kWords(machine.job.state);
}

bool may_jog(const spool::Spool& spool) {
    const spool::MachineView& machine = spool.machine();
    if (machine_word(machine) == "disconnected" || !machine.job.may_jog) return false;
    // Idle with a run: the run's first byte is on its way.
    return machine.job.state == MachineState::paused || !spool.active_run();
}

std::string_view job_word(const spool::Spool& spool, const spool::Job& job) {
    if (job.state == spool::JobState::queued && job.hold) return "held";
    const MachineState machine = spool.machine().job.state;
    const bool paused = machine == MachineState::paused || machine == MachineState::pausing;
    if (job.state == spool::JobState::printing && spool.machine().connected && paused) return "paused";
    return to_word(job.state);
}

Progress progress_of(const spool::Spool& spool, const spool::Job& job) {
    Progress progress;
    if (job.state == spool::JobState::done) return {job.size, 1, 0, 0.0};
    const spool::MachineView& machine = spool.machine();
    const auto& run = spool.active_run();
    if (!run || run->job != job.id || !machine.connected || machine.job.job_id != run->id) return progress;
    progress.bytes = std::min(machine.job.bytes_executed, job.size);
    progress.fraction =
        job.size > 0 ? static_cast<double>(progress.bytes) / static_cast<double>(job.size) : 0;
    const double elapsed_s = machine.job.print_time_s;
    progress.elapsed_s = std::isfinite(elapsed_s) && elapsed_s > 0 ? elapsed_s : 0;
    if (job.estimated_s > 0) {
        const Json facts = Json::parse(job.facts_json, nullptr, false);
        progress.remaining_s = remaining_s(facts, job.estimated_s, job.size,
                                           {progress.bytes, progress.elapsed_s, machine.job.heating_time_s});
    } else if (progress.fraction > 0.01) {
        progress.remaining_s = progress.elapsed_s / progress.fraction - progress.elapsed_s;
    } else {
        progress.remaining_s = std::nullopt;
    }
    return progress;
}

std::map<spool::JobId, Place> places_of(const spool::Spool& spool) {
    std::map<spool::JobId, Place> places;
    const spool::Job* printing = spool.queue().printing();
    std::optional<double> time_s = printing ? remaining_of(spool, *printing) : 0.0;
    for (const spool::Job* job : spool.queue().queued()) {
        Place& place = places[job->id];
        place.position = places.size();
        if (job->hold) continue;
        place.starts_in_s = time_s;
        const std::optional<double> remaining = remaining_of(spool, *job);
        time_s = time_s && remaining ? std::optional{*time_s + *remaining} : std::nullopt;
        place.ready_in_s = time_s;
    }
    return places;
}

namespace {

/// `places` is filled when the first job needs it: that takes a look at the whole queue.
Json job_json(const spool::Spool& spool, const spool::Job& job, std::map<spool::JobId, Place>& places) {
    std::optional<Place> place;
    if (job.state == spool::JobState::queued) {
        if (places.empty()) places = places_of(spool);
        if (const auto at = places.find(job.id); at != places.end()) place = at->second;
    }
    return {
        {"id", job.id},
        {"name", job.name},
        {"size", job.size},
        {"sha256", job.sha256},
        {"state", job_word(spool, job)},
        {"hold", job.hold},
        {"copies", job.copies},
        {"copies_done", job.copies_done},
        {"priority", job.priority},
        {"position", place ? Json(place->position) : Json{}},
        {"starts_in_s", place ? place->starts_in_s : std::nullopt},
        {"created", time_json(job.created_s)},
        {"started", time_json(job.started_s)},
        {"ended", time_json(job.ended_s)},
        {"error", text_or_null(job.error)},
        {"stopped_line", job.stopped_line},
        {"stopped_layer", job.stopped_layer},
        {"facts", facts_json(job)},
        {"progress", progress_json(progress_of(spool, job))},
    };
}

Json counts_json(const spool::Spool& spool) {
    const spool::JobCounts& counts = spool.counts();
    std::int64_t held = 0;
    for (const spool::Job& job : spool.queue().jobs())
        held += job.state == spool::JobState::queued && job.hold ? 1 : 0;
    return {{"queued", counts.queued - held}, {"held", held},
            {"printing", counts.printing},    {"done", counts.done},
            {"cancelled", counts.cancelled},  {"failed", counts.failed},
            {"total", counts.total()}};
}

Json list_json(const spool::Spool& spool, const spool::JobPage& page) {
    std::map<spool::JobId, Place> places;
    Json jobs = Json::array();
    for (const spool::Job& job : page.jobs) jobs.push_back(job_json(spool, job, places));
    return {{"jobs", std::move(jobs)},
            {"next_before", page.next_before},
            {"counts", counts_json(spool)},
            {"queue", gate_json(spool)}};
}

/// Whole seconds until each waiting job of the first page is done. None while the queue does not go
/// on by itself.
Json ready_json(const spool::Spool& spool, std::string_view state) {
    Json ready = Json::object();
    const spool::QueueGate& gate = spool.gate();
    if (!gate.hold_reason.empty() || gate.bed_occupied || state == "faulted" || state == "disconnected")
        return ready;
    for (const auto& [id, place] : places_of(spool)) {
        if (place.ready_in_s && place.position <= spool::JobQuery::kFirstWaiting)
            ready[std::to_string(id)] = std::llround(*place.ready_in_s);
    }
    return ready;
}

/// Of the job that prints; null when none does.
Json running_progress_json(const spool::Spool& spool) {
    const spool::Job* job = spool.queue().printing();
    return job && spool.active_run() ? progress_json(progress_of(spool, *job)) : Json{};
}

}  // namespace

Json job_json(const spool::Spool& spool, const spool::Job& job) {
    std::map<spool::JobId, Place> places;
    return job_json(spool, job, places);
}

Result<Json> page_json(const spool::Spool& spool, const spool::JobQuery& query) {
    QDUINO_TRY_ASSIGN(const spool::JobPage page, spool.page(query));
    return list_json(spool, page);
}

Json jobs_json(const spool::Spool& spool) {
    Result<Json> page = page_json(spool, {});
    return page.ok() ? std::move(*page) : list_json(spool, {});
}

Json status_json(const spool::Spool& spool) {
    const spool::MachineView& machine = spool.machine();
    const std::string_view state = machine_word(machine);
    const auto& job = machine.job;
    const auto& heat = machine.heat;
    return {
        {"connected", state != "disconnected"},
        {"session", machine.connected ? Json(hexadecimal(machine.session)) : Json{}},
        {"state", state},
        {"job", spool.active_run() ? Json(spool.active_run()->job) : Json{}},
        {"fault", machine.connected ? fault_json(machine) : Json{}},
        {"message", job.message.view()},
        {"position_mm",
         {{"x", job.position_mm[0]},
          {"y", job.position_mm[1]},
          {"z", job.position_mm[2]},
          {"e", job.position_mm[3]}}},
        {"homed", job.homed},
        {"hot_end", heater_json(heat.hot_end)},
        {"bed", heater_json(heat.bed)},
        {"fan", heat.fan_duty},
        {"idle_off_in_s", heat.idle_left_s >= 0 ? Json(heat.idle_left_s) : Json{}},
        {"idle_timed_out", heat.idle_timed_out},
        {"idle_timeout_s", heat.idle_timeout_s},
        {"parked", job.parked && job.state == MachineState::paused},
        {"may_jog", may_jog(spool)},
        {"time_factor", machine.time_factor},
        {"feed_factor", job.feed_factor},
        {"flow_factor", job.flow_factor},
        {"layer", job.layer},
        {"line", job.line},
        {"bytes_executed", job.bytes_executed},
        {"bytes_accepted", job.bytes_accepted},
        {"print_time_s", job.print_time_s},
        {"progress", running_progress_json(spool)},
        {"ready_in_s", ready_json(spool, state)},
        {"timing", timing_json(machine.motion)},
    };
}

}  // namespace qduino::web::api
