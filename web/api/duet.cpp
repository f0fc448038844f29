// RepRapFirmware's HTTP interface, as far as a slicer speaks it whose host type is Duet:
// PrusaSlicer and OrcaSlicer, and Cura by its plug-in for such printers (docs/api.md, "What slicers
// speak").
//
//   GET  /rr_connect?password=KEY&time=…                     the key is right: {"err":0}, else 1
//   POST /rr_upload?name=0:/gcodes/a.gcode&time=…&crc32=…    the body is the file; it is kept, held
//   GET  /rr_gcode?gcode=M32 "0:/gcodes/a.gcode"             it may print
//   GET  /rr_disconnect
//
// The difficulty: the password comes once, and behind it a client is known by its address alone
// (Guard::address). And a refusal has two forms. A slicer reads `err` in the answer to rr_connect
// and says "Wrong password". After every other call it shows the refusal's status and words, which
// say more than `err` could. So rr_connect alone refuses by `err`.
//
// Facts: RepRapFirmware's "HTTP requests" and its OpenAPI description (rr_…). Which calls a slicer
// makes, and what it reads of an answer, is in the public source of its host type (PrusaSlicer's
// Duet, Cura-DuetRRFPlugin's output device).
#include <algorithm>
#include <array>

#include "base/whole_number.h"
#include "printer/link/crc32.h"
#include "web/api/json.h"
#include "web/api/route.h"
#include "web/authentication.h"
#include "web/metrics.h"
#include "web/upload.h"

namespace qduino::web::api {

namespace {

constexpr std::string_view kFolder = "gcodes/";

/// "0:/gcodes/lids/box.gcode" → "lids/box.gcode"; so is a name without a folder in front. Error:
/// invalid_argument, where it lies elsewhere on the firmware's card.
Result<std::string> name_on_card(std::string_view path) {
    if (path.starts_with("0:")) path.remove_prefix(2);
    const bool from_root = path.starts_with('/');
    if (from_root) path.remove_prefix(1);
    const bool in_folder = path.starts_with(kFolder);
    if (in_folder) path.remove_prefix(kFolder.size());
    if (path.empty() || (from_root && !in_folder))
        return make_error(ErrorCode::invalid_argument, "files are kept below 0:/gcodes/ alone");
    return std::string{path};
}

/// The same with a folder as a part of the name, as uploads get it.
Result<std::string> name_of_job(std::string_view path) {
    QDUINO_TRY_ASSIGN(const std::string name, name_on_card(path));
    const std::string_view whole{name};
    const std::size_t file = whole.rfind('/') + 1;  // 0 where there is no folder: npos wraps
    return name_in_folder(whole.substr(0, file), whole.substr(file));
}

// ---- the visit ----------------------------------------------------------------------------------

Response err_answer(bool well) { return json_response({{"err", well ? 0 : 1}}); }

Response rr_connect(Context& context, const Call& call) {
    Authenticator& authenticator = *context.authenticator;
    const std::string& who = call.request.client.name;
    const Proof proof = authenticator.prove_key(call.request.head.query_value("password"), who, call.now);
    if (std::optional<Response> refusal = refusal_of(proof)) {
        context.metrics->count_refused_login();
        return proof == Proof::limited ? std::move(*refusal) : err_answer(false);
    }
    authenticator.visitors.enter(who, call.now);
    return json_response({{"err", 0},
                          {"sessionTimeout", AddressTable::kLifetime / std::chrono::milliseconds{1}},
                          {"boardType", "qduinomc"},
                          {"apiLevel", 1}});
}

Response rr_disconnect(Context& context, const Call& call) {
    return err_answer(context.authenticator->visitors.leave(call.request.client.name));
}

// ---- uploads ------------------------------------------------------------------------------------

class DuetUpload final : public Upload {
  public:
    /// Without `crc32` the bytes are taken as they come.
    DuetUpload(spool::Files& files, std::string name, std::optional<std::uint32_t> crc32)
        : Upload(files), declared_(crc32) {
        name_ = std::move(name);
    }
    Result<void> take(std::span<const char> bytes) override {
        if (!file_) QDUINO_TRY(begin_file(name_));
        crc32_ =
            printer::link::crc32({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, crc32_);
        return write_file(bytes);
    }

  private:
    Result<void> end() override {
        if (!declared_ || crc32_ == *declared_) return {};
        return make_error(ErrorCode::corrupt,
                          "the bytes have another CRC-32 than was declared; send them again");
    }

    std::optional<std::uint32_t> declared_;
    std::uint32_t crc32_ = 0;
};

/// "cbf43926". Error: invalid_argument.
Result<std::optional<std::uint32_t>> declared_crc32(const std::string& digits) {
    if (digits.empty()) return std::optional<std::uint32_t>{};
    const auto value = whole_number<std::uint32_t>(digits, 16);
    if (!value || digits.size() > 8)
        return make_error(ErrorCode::invalid_argument, "crc32 must be up to eight hexadecimal digits");
    return value;
}

/// The time of the sender's file comes, too. Jobs have the time at which they came.
Result<std::unique_ptr<Upload>> open_rr_upload(spool::Files& files, const RequestHead& head,
                                               const std::vector<std::string>&) {
    QDUINO_TRY_ASSIGN(std::string name, name_of_job(head.query_value("name")));
    QDUINO_TRY_ASSIGN(const std::optional<std::uint32_t> crc32, declared_crc32(head.query_value("crc32")));
    return std::unique_ptr<Upload>{std::make_unique<DuetUpload>(files, std::move(name), crc32)};
}

Response rr_uploaded(Context&, const Call&) { return err_answer(true); }

// ---- files --------------------------------------------------------------------------------------

/// The job of this name that came last: where a name comes again, the firmware overwrites its file.
/// It is among the first thousand whose names have it in them. Errors: not_found, as Spool::page().
Result<spool::Job> find_file(Context& context, std::string_view path) {
    QDUINO_TRY_ASSIGN(const std::string name, name_of_job(path));
    spool::JobQuery query;
    query.text = name;
    query.limit = spool::JobQuery::kLimitMax;
    QDUINO_TRY_ASSIGN(const spool::JobPage page, context.spool.page(query));
    const spool::Job* newest = nullptr;
    for (const spool::Job& job : page.jobs) {
        if (job.name == name && (!newest || job.id > newest->id)) newest = &job;
    }
    if (!newest) return make_error(ErrorCode::not_found, "there is no file of this name");
    return *newest;
}

/// A date as the firmware has it: without a zone.
std::string date_text(spool::UnixSeconds time_s) { return spool::utc_text(time_s, "%Y-%m-%dT%H:%M:%S"); }

/// The first page of the jobs, each name once.
Response rr_filelist(Context& context, const Call& call) {
    const std::string folder = call.request.head.query_value("dir");
    const bool known = folder == "0:/gcodes" || folder == "0:/gcodes/" || folder == "/gcodes";
    if (!known)
        return json_response(
            {{"dir", folder}, {"first", 0}, {"files", Json::array()}, {"next", 0}, {"err", 2}});
    const Result<spool::JobPage> page = context.spool.page({});
    if (!page.ok()) return error_response(page.error());
    Json files = Json::array();
    for (const spool::Job& job : page->jobs) {
        const bool listed =
            std::ranges::any_of(files, [&](const Json& file) { return file["name"] == job.name; });
        if (listed) continue;
        files.push_back(
            {{"type", "f"}, {"name", job.name}, {"size", job.size}, {"date", date_text(job.created_s)}});
    }
    return json_response(
        {{"dir", folder}, {"first", 0}, {"files", std::move(files)}, {"next", 0}, {"err", 0}});
}

/// Without a name: of the file that prints.
Response rr_fileinfo(Context& context, const Call& call) {
    const std::string path = call.request.head.query_value("name");
    const spool::Job* const printing = context.spool.queue().printing();
    if (path.empty() && !printing) return err_answer(false);
    const Result<spool::Job> job = path.empty() ? Result<spool::Job>{*printing} : find_file(context, path);
    if (!job.ok())
        return job.error().code == ErrorCode::not_found ? err_answer(false) : error_response(job.error());
    const Json facts = object_of(job->facts_json).value_or(Json::object());
    Json answer{{"err", 0},
                {"fileName", "0:/gcodes/" + job->name},
                {"size", job->size},
                {"lastModified", date_text(job->created_s)},
                {"numLayers", facts.value("layers", Json(0))},
                {"printTime", static_cast<std::int64_t>(job->estimated_s)},
                {"filament", Json::array({facts.value("filament_mm", Json(0))})},
                {"generatedBy", facts.value("slicer", Json(""))}};
    if (path.empty())
        answer["printDuration"] = static_cast<std::int64_t>(progress_of(context.spool, *job).elapsed_s);
    return json_response(answer);
}

// ---- the machine --------------------------------------------------------------------------------

/// The firmware's letter for what the machine does.
std::string_view status_letter(std::string_view state) {
    static constexpr std::pair<std::string_view, std::string_view> kLetters[] = {
        {"idle", "I"},    {"printing", "P"},   {"pausing", "D"}, {"paused", "S"},
        {"faulted", "H"}, {"cancelling", "B"}, {"starting", "C"}};
    const auto at = std::ranges::find(kLetters, state, &std::pair<std::string_view, std::string_view>::first);
    return at == std::end(kLetters) ? "O" : at->second;
}

Json rr_heater(const printer::link::HeaterStatus& heater) {
    constexpr int kOff = 0, kActive = 2, kFault = 3;
    return {{"current", heater.celsius},
            {"active", heater.target_celsius},
            {"state", heater.fault                ? kFault
                      : heater.target_celsius > 0 ? kActive
                                                  : kOff}};
}

/// What every `type` has of it, and what 3 has of a print.
Response rr_status(Context& context, const Call&) {
    const spool::MachineView& machine = context.spool.machine();
    const auto& [x, y, z] = machine.job.homed;
    Json answer{
        {"status", status_letter(machine_word(machine))},
        {"coords",
         {{"axesHomed", {x ? 1 : 0, y ? 1 : 0, z ? 1 : 0}},
          {"xyz", {machine.job.position_mm[0], machine.job.position_mm[1], machine.job.position_mm[2]}}}},
        {"params",
         {{"fanPercent", {machine.heat.fan_duty * 100}},
          {"speedFactor", machine.job.feed_factor * 100},
          {"extrFactors", {machine.job.flow_factor * 100}}}},
        {"temps",
         {{"bed", rr_heater(machine.heat.bed)},
          {"current", {machine.heat.bed.celsius, machine.heat.hot_end.celsius}}}}};
    if (const spool::Job* const job = context.spool.queue().printing()) {
        const Progress progress = progress_of(context.spool, *job);
        answer["currentLayer"] = machine.job.layer;
        answer["fractionPrinted"] = progress.fraction * 100;
        answer["filePosition"] = progress.bytes;
        answer["printDuration"] = progress.elapsed_s;
        answer["timesLeft"] = {{"file", progress.remaining_s.value_or(0)}};
    }
    return json_response(answer);
}

/// The name behind a code: `"0:/gcodes/a.gcode"`, or without quotes.
std::string_view name_behind(std::string_view rest) {
    rest = trimmed(rest);
    const bool quoted = rest.size() >= 2 && rest.front() == '"' && rest.back() == '"';
    return quoted ? rest.substr(1, rest.size() - 2) : rest;
}

/// M32: it is printed when its turn comes, as every job is.
Response print_file(Context& context, std::string_view path) {
    const Result<spool::Job> job = find_file(context, path);
    if (!job.ok()) return error_response(job.error());
    return answer(context.spool.start(job->id), err_answer(true));
}

Response rr_gcode(Context& context, const Call& call) {
    const std::string text = call.request.head.query_value("gcode");
    std::string_view rest = trimmed(text);
    if (rest.starts_with("M32 ")) return print_file(context, name_behind(rest.substr(4)));
    if (rest.starts_with("M37"))
        return web::error_response(
            501, "unsupported",
            "nothing is simulated here: how long a file takes is known when it is uploaded");
    std::vector<std::string> lines;
    while (!rest.empty()) {
        const std::string_view line = trimmed(take_until(rest, '\n'));
        if (!line.empty()) lines.emplace_back(line);
    }
    constexpr std::size_t kLinesMax = 64;  // as OctoPrint's commands
    if (lines.size() > kLinesMax) return refused(ErrorCode::invalid_argument, "at most 64 lines at once");
    const Result<void> sent = lines.empty() ? Result<void>{} : send_checked(context, lines);
    constexpr int kRoom = 250;  // bytes, as a firmware that has nothing to do tells it
    return answer(sent, json_response({{"buff", kRoom}}));
}

constexpr std::array kDuetRoutes{
    Route{Method::get, "/rr_connect", rr_connect, Thread::io, Guard::login, Body::none},
    Route{Method::get, "/rr_disconnect", rr_disconnect, Thread::io, Guard::address, Body::none},
    Route{Method::post, "/rr_upload", rr_uploaded, Thread::spool, Guard::address, Body::upload,
          open_rr_upload},
    Route{Method::get, "/rr_gcode", rr_gcode, Thread::spool, Guard::address},
    Route{Method::get, "/rr_status", rr_status, Thread::spool, Guard::address},
    Route{Method::get, "/rr_filelist", rr_filelist, Thread::spool, Guard::address},
    Route{Method::get, "/rr_fileinfo", rr_fileinfo, Thread::spool, Guard::address},
};

}  // namespace

std::span<const Route> duet_routes() { return kDuetRoutes; }

}  // namespace qduino::web::api
