// Two calls of Moonraker's interface: with them a slicer whose host type is Moonraker (PrusaSlicer,
// OrcaSlicer) tests its connection, uploads, and has its file printed (docs/api.md, "What slicers
// speak").
//
// Facts: Moonraker's documentation, "Query Server Info" and "File Upload"; which fields a slicer
// reads is in its source of that host type.
#include <array>

#include "base/whole_number.h"
#include "web/api/json.h"
#include "web/api/route.h"
#include "web/upload.h"

namespace qduino::web::api {

namespace {

/// Klipper's word for what the machine can do now.
std::string_view klippy_state(std::string_view state) {
    if (state == "disconnected") return "disconnected";
    if (state == "starting") return "startup";
    return state == "faulted" ? "shutdown" : "ready";
}

/// OrcaSlicer asks for `klippy_state`, PrusaSlicer for `moonraker_version`.
Response server_info(Context& context, const Call&) {
    const std::string_view state = klippy_state(machine_word(context.spool.machine()));
    return json_response({{"result",
                           {{"klippy_connected", state != "disconnected"},
                            {"klippy_state", state},
                            {"components", Json::array()},
                            {"failed_components", Json::array()},
                            {"registered_directories", {"gcodes"}},
                            {"warnings", Json::array()},
                            {"moonraker_version", "QduinoMC " + context.version}}}});
}

/// An upload has become this job. Nobody need start it: where it shall be printed it is queued.
Response file_uploaded(Context& context, const Call& call) {
    const spool::Job& job =
        *context.spool.queue().find(whole_number<spool::JobId>(call.arguments.front()).value());
    Response response =
        json_response({{"result",
                        {{"item", {{"path", job.name}, {"root", "gcodes"}, {"size", job.size}}},
                         {"print_started", false},
                         {"print_queued", !job.hold},
                         {"action", "create_file"}}}},
                      201);
    response.add("Location", call.request.client.address() + "/api/v1/jobs/" + call.arguments.front());
    return response;
}

constexpr std::array kMoonrakerRoutes{
    Route{Method::get, "/server/info", server_info},
    upload_route(Method::post, "/server/files/upload", file_uploaded, open_multipart),
};

}  // namespace

std::span<const Route> moonraker_routes() { return kMoonrakerRoutes; }

}  // namespace qduino::web::api
