// The part of OctoPrint's interface that slicers speak: its facts are in docs/api.md, "What slicers
// speak".
#include <algorithm>
#include <array>

#include "base/whole_number.h"
#include "web/api/json.h"
#include "web/api/route.h"
#include "web/upload.h"

namespace qduino::web::api {

namespace {

Response version(Context& context, const Call&) {
    return json_response({{"api", "0.1"},
                          {"server", context.version},
                          {"text", "OctoPrint (QduinoMC " + context.version + ")"},
                          {"nozzle_diameter", context.machine.nozzle_diameter.value()},
                          {"capabilities", {{"upload-by-put", true}}}});
}

Json flags_json(std::string_view state) {
    const bool operational = state == "idle" || state == "printing" || state == "pausing" ||
                             state == "paused" || state == "cancelling";
    return {
        {"operational", operational},    {"printing", state == "printing"},     {"paused", state == "paused"},
        {"pausing", state == "pausing"}, {"cancelling", state == "cancelling"}, {"ready", state == "idle"},
        {"error", state == "faulted"},   {"closedOrError", !operational},       {"sdReady", false}};
}

std::string_view state_text(std::string_view state) {
    static constexpr std::pair<std::string_view, std::string_view> kTexts[] = {
        {"idle", "Operational"}, {"printing", "Printing"},     {"pausing", "Pausing"},
        {"paused", "Paused"},    {"cancelling", "Cancelling"}, {"faulted", "Error"}};
    const auto at = std::ranges::find(kTexts, state, &std::pair<std::string_view, std::string_view>::first);
    return at == std::end(kTexts) ? "Offline" : at->second;
}

Json heater_json(const printer::link::HeaterStatus& heater) {
    return {{"actual", heater.celsius}, {"target", heater.target_celsius}, {"offset", 0}};
}

Response printer_state(Context& context, const Call&) {
    const spool::MachineView& machine = context.spool.machine();
    const std::string_view state = machine_word(machine);
    if (state == "disconnected") return refused(ErrorCode::not_permitted, "Printer is not operational");
    return json_response(
        {{"temperature",
          {{"tool0", heater_json(machine.heat.hot_end)}, {"bed", heater_json(machine.heat.bed)}}},
         {"sd", {{"ready", false}}},
         {"state", {{"text", state_text(state)}, {"flags", flags_json(state)}}}});
}

Json file_json(const spool::Job* job) {
    if (!job) return {{"name", nullptr}, {"origin", nullptr}, {"size", nullptr}, {"date", nullptr}};
    return {{"name", job->name}, {"origin", "local"}, {"size", job->size}, {"date", job->created_s}};
}

Response job_state(Context& context, const Call&) {
    const spool::Job* job = context.spool.queue().printing();
    const Progress progress = job ? progress_of(context.spool, *job) : Progress{};
    Json progress_json{
        {"completion", nullptr}, {"filepos", nullptr}, {"printTime", nullptr}, {"printTimeLeft", nullptr}};
    if (job) {
        progress_json = {{"completion", progress.fraction * 100},
                         {"filepos", progress.bytes},
                         {"printTime", static_cast<std::int64_t>(progress.elapsed_s)},
                         {"printTimeLeft", static_cast<std::int64_t>(progress.remaining_s.value_or(0))}};
    }
    const Json estimated = job && job->estimated_s > 0 ? Json(job->estimated_s) : Json{};
    return json_response({{"job", {{"file", file_json(job)}, {"estimatedPrintTime", estimated}}},
                          {"progress", progress_json},
                          {"state", state_text(machine_word(context.spool.machine()))}});
}

/// {"command":"pause","action":"pause|resume|toggle"} · {"command":"cancel"} · {"command":"start"}
Response job_command(Context& context, const Call& call) {
    const std::string command = text_member(call.request.body, "command").value_or("");
    if (command == "cancel") return answer(context.spool.cancel(), no_content());
    if (command == "start") return answer(context.spool.release_queue(), no_content());
    if (command != "pause")
        return refused(ErrorCode::invalid_argument, "known commands: start, cancel, pause");
    const Json action = object_of(call.request.body)->value("action", Json("toggle"));
    const auto state = context.spool.machine().job.state;
    const bool pauses =
        action == "pause" || (action == "toggle" && state == printer::link::MachineState::printing);
    return answer(pauses ? context.spool.pause() : context.spool.resume(), no_content());
}

/// {"command":"M105"} or {"commands":["M105",…]}
Response printer_command(Context& context, const Call& call) {
    const std::optional<Json> body = object_of(call.request.body);
    std::vector<std::string> lines;
    const auto add = [&](const Json& line) {
        if (line.is_string() && lines.size() < 64) lines.push_back(line.get<std::string>());
        return line.is_string();
    };
    bool valid = body.has_value();
    if (valid && body->contains("command")) valid = add((*body)["command"]);
    if (valid && body->contains("commands")) {
        valid = (*body)["commands"].is_array();
        for (const Json& line : (*body)["commands"]) valid = valid && add(line);
    }
    if (!valid || lines.empty()) return refused(ErrorCode::invalid_argument, "give command or commands");
    return answer(send_checked(context, lines), no_content());
}

Response settings(Context& context, const Call&) {
    return json_response({{"api", {{"enabled", true}}},
                          {"appearance", {{"name", context.machine.name.view()}}},
                          {"webcam", {{"webcamEnabled", false}, {"streamUrl", ""}}},
                          {"feature", {{"sdSupport", false}}},
                          {"plugins", Json::object()}});
}

Response profiles(Context& context, const Call&) {
    const auto length_mm = [&](printer::Axis axis) {
        return (context.machine.axes[axis].maximum - context.machine.axes[axis].minimum).value();
    };
    const bool round = context.machine.kinematics.type == printer::KinematicsType::delta;
    return json_response({{"profiles",
                           {{"_default",
                             {{"id", "_default"},
                              {"name", context.machine.name.view()},
                              {"model", context.machine.name.view()},
                              {"default", true},
                              {"current", true},
                              {"heatedBed", context.machine.has_bed},
                              {"heatedChamber", false},
                              {"extruder",
                               {{"count", 1},
                                {"nozzleDiameter", context.machine.nozzle_diameter.value()},
                                {"sharedNozzle", false}}},
                              {"volume",
                               {{"formFactor", round ? "circular" : "rectangular"},
                                {"origin", round ? "center" : "lowerleft"},
                                {"width", length_mm(printer::Axis::x)},
                                {"depth", length_mm(printer::Axis::y)},
                                {"height", length_mm(printer::Axis::z)}}}}}}}});
}

/// `passive`: a client that gets here has shown the key already. Any other login would ask for a
/// name and a password.
Response login(Context&, const Call& call) {
    const std::optional<Json> body = object_of(call.request.body);
    if (!body || body->value("passive", Json(false)) != true) {
        return web::error_response(403, "not_permitted",
                                   "there are no passwords here; send the key as X-Api-Key");
    }
    return json_response({{"name", "_api"},
                          {"active", true},
                          {"admin", true},
                          {"user", true},
                          {"apikey", nullptr},
                          {"session", ""},
                          {"groups", {"admins"}},
                          {"needs", {{"role", Json::array()}}},
                          {"_is_external_client", false}});
}

/// GET /api/files: the first page of the jobs, in OctoPrint's form, which has no pages.
Response files(Context& context, const Call&) {
    const Result<spool::JobPage> page = context.spool.page({});
    if (!page.ok()) return error_response(page.error());
    Json list = Json::array();
    for (const spool::Job& job : page->jobs) {
        list.push_back({{"name", job.name},
                        {"path", job.name},
                        {"origin", "local"},
                        {"type", "machinecode"},
                        {"typePath", {"machinecode", "gcode"}},
                        {"size", job.size},
                        {"date", job.created_s}});
    }
    return json_response({{"files", std::move(list)}, {"free", nullptr}, {"total", nullptr}});
}

/// An upload has become this job. It prints at once when its sender wanted that.
Response file_created(Context& context, const Call& call) {
    const spool::Job& job =
        *context.spool.queue().find(whole_number<spool::JobId>(call.arguments.front()).value());
    const std::string resource = call.request.client.address() + "/api/v1/jobs/" + call.arguments.front();
    const Json local{{"name", job.name},
                     {"path", job.name},
                     {"origin", "local"},
                     {"refs", {{"resource", resource}, {"download", resource + "/file"}}}};
    Response response = json_response({{"files", {{"local", local}}},
                                       {"done", true},
                                       {"effectiveSelect", !job.hold},
                                       {"effectivePrint", !job.hold}},
                                      201);
    response.add("Location", resource);
    return response;
}

/// There is one machine, and the service finds it by itself: nothing to choose from.
Response connection(Context& context, const Call&) {
    return json_response(
        {{"current",
          {{"state", state_text(machine_word(context.spool.machine()))},
           {"port", "AUTO"},
           {"baudrate", nullptr},
           {"printerProfile", "_default"}}},
         {"options",
          {{"ports", Json::array({"AUTO"})},
           {"baudrates", Json::array()},
           {"printerProfiles", Json::array({{{"id", "_default"}, {"name", context.machine.name.view()}}})},
           {"portPreference", "AUTO"},
           {"baudratePreference", nullptr},
           {"printerProfilePreference", "_default"},
           {"autoconnect", true}}}});
}

constexpr std::array kOctoprintRoutes{
    Route{Method::get, "/api/version", version},
    Route{Method::get, "/api/printer", printer_state},
    Route{Method::get, "/api/job", job_state},
    Route{Method::post, "/api/job", job_command},
    Route{Method::post, "/api/printer/command", printer_command},
    Route{Method::get, "/api/settings", settings},
    Route{Method::get, "/api/printerprofiles", profiles},
    Route{Method::get, "/api/connection", connection},
    Route{Method::post, "/api/login", login},
    Route{Method::get, "/api/files", files},
    Route{Method::get, "/api/files/local", files},
    upload_route(Method::post, "/api/files/local", file_created, open_multipart),
};

}  // namespace

std::span<const Route> octoprint_routes() { return kOctoprintRoutes; }

}  // namespace qduino::web::api
