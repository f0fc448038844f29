// The part of PrusaLink's interface that PrusaSlicer and its companions speak. GET /api/version is
// octoprint.cpp's, and says that uploads by PUT are known.
#include <array>

#include "web/api/json.h"
#include "web/api/route.h"

namespace qduino::web::api {

namespace {

std::string_view state_of(const spool::Spool& spool) {
    const std::string_view state = machine_word(spool.machine());
    if (state == "disconnected" || state == "faulted") return "ERROR";
    if (state == "printing" || state == "cancelling") return "PRINTING";
    if (state == "paused" || state == "pausing") return "PAUSED";
    if (!spool.gate().hold_reason.empty() || spool.gate().bed_occupied) return "ATTENTION";
    return state == "idle" ? "IDLE" : "BUSY";
}

Json job_object(const spool::Spool& spool, const spool::Job& job) {
    const Progress progress = progress_of(spool, job);
    return {{"id", job.id},
            {"state", state_of(spool)},
            {"progress", progress.fraction * 100},
            {"time_printing", static_cast<std::int64_t>(progress.elapsed_s)},
            {"time_remaining", static_cast<std::int64_t>(progress.remaining_s.value_or(0))},
            {"file",
             {{"name", job.name},
              {"display_name", job.name},
              {"path", "/local"},
              {"size", job.size},
              {"m_timestamp", job.created_s}}}};
}

Json storage_object() {
    return {
        {"name", "local"}, {"path", "/local"}, {"type", "LOCAL"}, {"read_only", false}, {"available", true}};
}

Response info(Context& context, const Call&) {
    return json_response({{"name", context.machine.name.view()},
                          {"hostname", "qduinomc"},
                          {"nozzle_diameter", context.machine.nozzle_diameter.value()},
                          {"mmu", false},
                          {"min_extrusion_temp", context.machine.minimum_extrude.value()},
                          {"sd_ready", false},
                          {"active_camera", false}});
}

Response status(Context& context, const Call&) {
    const spool::MachineView& machine = context.spool.machine();
    Json answer{{"storage", storage_object()},
                {"printer",
                 {{"state", state_of(context.spool)},
                  {"temp_nozzle", machine.heat.hot_end.celsius},
                  {"target_nozzle", machine.heat.hot_end.target_celsius},
                  {"temp_bed", machine.heat.bed.celsius},
                  {"target_bed", machine.heat.bed.target_celsius},
                  {"axis_x", machine.job.position_mm[0]},
                  {"axis_y", machine.job.position_mm[1]},
                  {"axis_z", machine.job.position_mm[2]},
                  {"flow", machine.job.flow_factor * 100},
                  {"speed", machine.job.feed_factor * 100},
                  {"fan_print", machine.heat.fan_duty * 100}}}};
    if (const spool::Job* job = context.spool.queue().printing())
        answer["job"] = job_object(context.spool, *job);
    return json_response(answer);
}

Response job(Context& context, const Call&) {
    const spool::Job* printing = context.spool.queue().printing();
    return printing ? json_response(job_object(context.spool, *printing)) : no_content();
}

Response storage(Context&, const Call&) {
    return json_response({{"storage_list", Json::array({storage_object()})}});
}

Response transfer(Context&, const Call&) { return no_content(); }

/// Controls name the job, so that a late click does not hit the next job.
template <Result<void> (spool::Spool::*kAct)()>
Response of_printing_job(Context& context, const Call& call) {
    const spool::Job* printing = context.spool.queue().printing();
    if (!printing || call.arguments.front() != std::to_string(printing->id))
        return refused(ErrorCode::not_found, "this job is not printing");
    return act<kAct, no_content>(context, call);
}

constexpr std::array kPrusalinkRoutes{
    Route{Method::get, "/api/v1/info", info},
    Route{Method::get, "/api/v1/status", status},
    Route{Method::get, "/api/v1/job", job},
    Route{Method::get, "/api/v1/storage", storage},
    Route{Method::get, "/api/v1/transfer", transfer},
    Route{Method::put, "/api/v1/job/*/pause", of_printing_job<&spool::Spool::pause>},
    Route{Method::put, "/api/v1/job/*/resume", of_printing_job<&spool::Spool::resume>},
    Route{Method::put, "/api/v1/job/*/continue", of_printing_job<&spool::Spool::resume>},
    Route{Method::remove, "/api/v1/job/*", of_printing_job<&spool::Spool::cancel>},
};

}  // namespace

std::span<const Route> prusalink_routes() { return kPrusalinkRoutes; }

}  // namespace qduino::web::api
