#include "web/api/json.h"

#include <algorithm>
#include <cmath>

#include "base/words.h"
#include "web/api/eta.h"

namespace qduino::web::api {

using printer::link::MachineState;

namespace {

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

/// The time left for all copies of `job`, the running one included; nothing when it is unknown.
std::optional<double> remaining_of(const spool::Spool& spool, const spool::Job& job) {
    const bool printing = job.state == spool::JobState::printing;
    const int whole_copies = std::max(0, job.copies - job.copies_done - (printing ? 1 : 0));
    if (whole_copies > 0 && job.estimated_s <= 0) return std::nullopt;
    const std::optional<double> running = printing ? progress_of(spool, job).remaining_s : 0.0;
    return running ? std::optional{*running + job.estimated_s * whole_copies} : std::nullopt;
}

Json gate_json(const spool::Spool& spool) {
    const spool::QueueGate& gate = spool.gate();
    Json json{{"held", !gate.hold_reason.empty()},
              {"reason", text_or_null(gate.hold_reason)},
              {"bed_occupied", gate.bed_occupied},
              {"confirm_bed", spool.confirms_bed()}};
    if (!spool.storage().is_durable()) json["durable"] = false;
    return json;
}

}  // namespace

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
    return machine_word(machine.job.state);
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
    // Without an estimate the bytes must do for the time.
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
        progress.fraction = share_of_time(progress.elapsed_s, *progress.remaining_s);
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
Json placed_job_json(const spool::Spool& spool, const spool::Job& job,
                     std::map<spool::JobId, Place>& places) {
    std::optional<Place> place;
    if (job.state == spool::JobState::queued) {
        if (places.empty()) places = places_of(spool);
        if (const auto at = places.find(job.id); at != places.end()) place = at->second;
    }
    Json json = job_json(job, job_word(spool, job), progress_of(spool, job));
    json["position"] = place ? Json(place->position) : Json{};
    json["starts_in_s"] = place ? place->starts_in_s : std::nullopt;
    json["created"] = time_json(job.created_s);
    json["started"] = time_json(job.started_s);
    json["ended"] = time_json(job.ended_s);
    return json;
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
    for (const spool::Job& job : page.jobs) jobs.push_back(placed_job_json(spool, job, places));
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

/// The progress of the job that prints; null when none does.
Json running_progress_json(const spool::Spool& spool) {
    const spool::Job* job = spool.queue().printing();
    return job && spool.active_run() ? progress_json(progress_of(spool, *job)) : Json{};
}

}  // namespace

Json job_json(const spool::Spool& spool, const spool::Job& job) {
    std::map<spool::JobId, Place> places;
    return placed_job_json(spool, job, places);
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
    Json status{
        {"connected", state != "disconnected"},
        {"session", machine.connected ? Json(hexadecimal(machine.session)) : Json{}},
        {"state", state},
        {"job", spool.active_run() ? Json(spool.active_run()->job) : Json{}},
        {"fault", machine.connected ? fault_json(machine) : Json{}},
        {"may_jog", may_jog(spool)},
        {"time_factor", machine.time_factor},
        {"progress", running_progress_json(spool)},
        {"ready_in_s", ready_json(spool, state)},
    };
    status.update(machine_json(machine.job, machine.motion, machine.heat));
    return status;
}

}  // namespace qduino::web::api
