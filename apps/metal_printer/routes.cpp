#include "apps/metal_printer/routes.h"

#include <algorithm>
#include <array>
#include <utility>

#include "base/version.h"
#include "base/whole_number.h"
#include "web/api/answers.h"
#include "web/api/machine_json.h"

namespace qduino::apps::metal {

using printer::link::Command;
using printer::link::MachineState;
using spool::Job;
using spool::JobState;
using web::Method;
using web::RequestHead;
using web::Response;
using web::api::Json;
using web::api::json_response;

namespace {

using Arguments = std::vector<std::string>;
using Handler = Response (*)(MemorySpool&, const Arguments&);

struct Row {
    Method method;
    std::string_view pattern;  // as web/api/route.h has it
    Handler handler;
};

// ---- jobs ---------------------------------------------------------------------------------------

std::string_view word_of(const MemorySpool& spool, const Job& job) {
    const MachineState machine = spool.machine().job.state;
    if (job.state == JobState::queued && job.hold) return "held";
    if (job.state == JobState::printing &&
        (machine == MachineState::paused || machine == MachineState::pausing))
        return "paused";
    return to_word(job.state);
}

web::api::Progress progress_of(const MemorySpool& spool, const Job& job) {
    web::api::Progress progress{.remaining_s = std::nullopt};
    if (job.state == JobState::done) return {job.size, 1, 0, 0.0};
    const auto& status = spool.machine().job;
    if (!spool.run() || spool.run()->job != job.id || status.job_id != spool.run()->id) return progress;
    progress.bytes = std::min(status.bytes_executed, job.size);
    progress.fraction = static_cast<double>(progress.bytes) / static_cast<double>(job.size);
    progress.elapsed_s = status.print_time_s;
    return progress;
}

Json job_of(const MemorySpool& spool, const Job& job) {
    return web::api::job_json(job, word_of(spool, job), progress_of(spool, job));
}

Response list_jobs(MemorySpool& spool, const Arguments&) {
    Json jobs = Json::array();
    for (const Job* const job : spool.jobs()) jobs.push_back(job_of(spool, *job));
    Json counts{{"total", spool.jobs().size()}, {"held", 0}};
    for (const JobState state :
         {JobState::queued, JobState::printing, JobState::done, JobState::cancelled, JobState::failed})
        counts[std::string(to_word(state))] = std::ranges::count(spool.jobs(), state, &Job::state);
    return json_response({{"jobs", std::move(jobs)},
                          {"next_before", nullptr},
                          {"counts", std::move(counts)},
                          {"queue",
                           {{"held", false},
                            {"reason", nullptr},
                            {"bed_occupied", spool.bed_occupied()},
                            {"confirm_bed", true},
                            {"durable", false},
                            {"places", 1}}}});
}

Response no_such_job() { return web::api::error_response(spool::no_such_job()); }

/// A handler for the job that the path names.
template <Response (*kHandler)(MemorySpool&, const Job&)>
Response of_job(MemorySpool& spool, const Arguments& arguments) {
    const auto id = whole_number<spool::JobId>(arguments.front());
    const Job* const job = id ? spool.find(*id) : nullptr;
    return job ? kHandler(spool, *job) : no_such_job();
}

Response get_job(MemorySpool& spool, const Job& job) { return json_response(job_of(spool, job)); }

Response job_file(MemorySpool& spool, const Job& job) {
    return {.content_type = "application/octet-stream", .shared = spool.bytes_of(job.id)};
}

Response start_job(MemorySpool& spool, const Job& job) {
    const spool::JobId id = job.id;
    if (const Result<void> started = spool.start(id); !started)
        return web::api::error_response(started.error());
    return get_job(spool, *spool.find(id));
}

Response delete_job(MemorySpool& spool, const Job& job) {
    return web::api::answer(spool.remove(job.id), web::api::no_content());
}

// ---- the machine --------------------------------------------------------------------------------

Response machine_status(MemorySpool& spool, const Arguments&) {
    const spool::MachineView& machine = spool.machine();
    const bool faulted = machine.job.state == MachineState::faulted;
    Json status{
        {"connected", true},
        {"session", std::to_string(machine.session)},
        {"state", web::api::machine_word(machine.job.state)},
        {"job", spool.run() ? Json(spool.run()->job) : Json{}},
        {"fault", web::api::text_or_null(faulted ? machine.job.fault.view() : machine.heat.fault.view())},
        {"may_jog", machine.job.may_jog && !spool.run()},
        {"time_factor", 1},
        {"durable", false},
        {"lacks", {"live", "hand", "layers", "guarantee", "queue", "invitation"}},
        {"progress", nullptr},
        {"ready_in_s", Json::object()},
    };
    if (const Job* const job = spool.run() ? spool.find(spool.run()->job) : nullptr)
        status["progress"] = web::api::progress_json(progress_of(spool, *job));
    status.update(web::api::machine_json(machine.job, machine.motion, machine.heat));
    return json_response(status);
}

template <Command kCommand>
Response command(MemorySpool& spool, const Arguments&) {
    return web::api::answer(spool.send(kCommand), web::api::accepted());
}

Response cancel(MemorySpool& spool, const Arguments&) {
    return web::api::answer(spool.cancel(), web::api::accepted());
}
Response emergency_stop(MemorySpool& spool, const Arguments&) {
    spool.emergency_stop();
    return web::api::accepted();
}
Response bed_cleared(MemorySpool& spool, const Arguments&) {
    spool.bed_cleared();
    return web::api::accepted();
}
Response octoprint_version(MemorySpool&, const Arguments&) {
    return json_response({{"api", "0.1"},
                          {"server", version()},
                          {"text", std::string("OctoPrint (QduinoMC ") + std::string(version()) + ")"}});
}

constexpr std::array kRows{
    Row{Method::get, "/api/v1/jobs", list_jobs},
    Row{Method::get, "/api/v1/jobs/*", of_job<get_job>},
    Row{Method::remove, "/api/v1/jobs/*", of_job<delete_job>},
    Row{Method::get, "/api/v1/jobs/*/file", of_job<job_file>},
    Row{Method::post, "/api/v1/jobs/*/start", of_job<start_job>},
    Row{Method::get, "/api/v1/machine", machine_status},
    Row{Method::post, "/api/v1/machine/pause", command<Command::pause>},
    Row{Method::post, "/api/v1/machine/resume", command<Command::resume>},
    Row{Method::post, "/api/v1/machine/clear-fault", command<Command::clear_fault>},
    Row{Method::post, "/api/v1/machine/cancel", cancel},
    Row{Method::post, "/api/v1/machine/emergency-stop", emergency_stop},
    Row{Method::post, "/api/v1/machine/bed-cleared", bed_cleared},
    Row{Method::get, "/api/version", octoprint_version},
};

struct UploadRow {
    Method method;
    std::string_view pattern;
};
constexpr std::array kUploadRows{
    UploadRow{Method::post, "/api/v1/jobs"},
    UploadRow{Method::put, "/api/v1/jobs/**"},
    UploadRow{Method::post, "/api/files/local"},
    UploadRow{Method::put, "/api/v1/files/local/**"},
};

}  // namespace

std::optional<std::string> upload_name_of(const RequestHead& head) {
    Arguments arguments;
    for (const UploadRow& row : kUploadRows) {
        if (row.method == head.method && web::api::fits_pattern(row.pattern, head.path, arguments))
            return arguments.empty() ? std::string{} : arguments.back();
    }
    return std::nullopt;
}

Response answer_upload(MemorySpool& spool, Result<Uploaded> upload) {
    if (!upload) return web::api::error_response(upload.error());
    const Result<spool::JobId> id = spool.add(std::move(*upload));
    if (!id) return web::api::error_response(id.error());
    Response response = json_response(job_of(spool, *spool.find(*id)), 201);
    response.add("Location", "/api/v1/jobs/" + std::to_string(*id));
    return response;
}

Response answer(MemorySpool& spool, const RequestHead& head) {
    bool known = false;
    Arguments arguments;
    for (const Row& row : kRows) {
        if (!web::api::fits_pattern(row.pattern, head.path, arguments)) continue;
        if (row.method == head.method) return row.handler(spool, arguments);
        known = true;
    }
    return known ? web::error_response(405, "not_permitted", "this path takes another method")
                 : web::error_response(404, "not_found", "this printer has no such path");
}

}  // namespace qduino::apps::metal
