// /api/v1/jobs and /api/v1/queue: what a person may do with jobs (docs/api.md, "Jobs").
#include "base/whole_number.h"
#include "web/api/json.h"
#include "web/api/route.h"
#include "web/upload.h"

namespace qduino::web::api {

namespace {

using spool::FilePart;
using spool::Job;
using spool::JobPatch;

std::optional<Job> job_of(Context& context, const Call& call) {
    const std::optional<std::int64_t> id = whole_number<spool::JobId>(call.arguments.front());
    return id ? context.spool.find(*id) : std::nullopt;
}

Response no_such_job() { return error_response(spool::no_such_job()); }

Response answer_job(Context& context, spool::JobId id, const Result<void>& done) {
    if (!done.ok()) return error_response(done.error());
    const std::optional<Job> job = context.spool.find(id);
    return job ? json_response(job_json(context.spool, *job)) : no_such_job();
}

/// Null: it is not there.
std::shared_ptr<const ByteSource> part_of(Context& context, const Job& job, FilePart part) {
    return context.spool.files().content(job.sha256, part);
}

Response file_response(std::shared_ptr<const ByteSource> bytes, std::string content_type) {
    if (!bytes) return refused(ErrorCode::not_found, "the job's file is missing");
    const std::uint64_t size = bytes->size();
    return {.content_type = std::move(content_type), .file = FileRange{std::move(bytes), 0, size}};
}

Response list_jobs(Context& context, const Call& call) {
    Job running;
    running.state = spool::JobState::printing;
    const Result<spool::JobQuery> query =
        job_query_of(call.request.head.query, job_word(context.spool, running));
    if (!query.ok()) return error_response(query.error());
    const Result<Json> page = page_json(context.spool, *query);
    return page.ok() ? json_response(*page) : error_response(page.error());
}

/// An upload has become this job.
Response job_created(Context& context, const Call& call) {
    Response response = json_response(job_json(context.spool, *job_of(context, call)), 201);
    response.add("Location", call.request.client.prefix + "/api/v1/jobs/" + call.arguments.front());
    return response;
}

/// A handler for the job that the path names.
template <Response (*kHandler)(Context&, const Call&, const Job&)>
Response of_job(Context& context, const Call& call) {
    const std::optional<Job> job = job_of(context, call);
    return job ? kHandler(context, call, *job) : no_such_job();
}

Response get_job(Context& context, const Call&, const Job& job) {
    return json_response(job_json(context.spool, job));
}

Response delete_job(Context& context, const Call&, const Job& job) {
    return answer(context.spool.remove(job.id), no_content());
}

/// Fills `patch` from one member of the body. False when its type or name is wrong.
bool read_member(const std::string& name, const Json& value, JobPatch& patch) {
    const auto small_number = [&](std::optional<int>& field) {
        if (!value.is_number_integer()) return false;
        const std::int64_t number = value.get<std::int64_t>();
        if (number < -1'000'000 || number > 1'000'000) return false;
        field = static_cast<int>(number);
        return true;
    };
    if (name == "copies") return small_number(patch.copies);
    if (name == "priority") return small_number(patch.priority);
    if (name == "hold") {
        if (value.is_boolean()) patch.hold = value.get<bool>();
        return value.is_boolean();
    }
    if (name != "before") return false;
    patch.move = true;
    if (value.is_number_integer()) patch.before = value.get<std::int64_t>();
    return value.is_null() || value.is_number_integer();
}

Response patch_job(Context& context, const Call& call, const Job& job) {
    const std::optional<Json> body = object_of(call.request.body);
    if (!body) return refused(ErrorCode::invalid_argument, "the body must be a JSON object");
    JobPatch patch;
    for (const auto& [name, value] : body->items()) {
        if (!read_member(name, value, patch)) {
            return refused(
                ErrorCode::invalid_argument,
                "only hold (true or false), copies, priority (whole numbers) and before (a job's number or "
                "null) can be changed");
        }
    }
    return answer_job(context, job.id, context.spool.patch(job.id, patch));
}

Response start_job(Context& context, const Call&, const Job& job) {
    return answer_job(context, job.id, context.spool.start(job.id));
}

/// Only characters that need no quoting in any header survive.
std::string attachment(const std::string& name) {
    std::string plain;
    for (const char c : name) plain += is_letter_or_digit(c) || c == '.' || c == '-' ? c : '_';
    return "attachment; filename=\"" + plain + "\"";
}

Response job_file(Context& context, const Call&, const Job& job) {
    Response response = file_response(part_of(context, job, FilePart::gcode), "application/octet-stream");
    response.add("Content-Disposition", attachment(job.name));
    return response;
}

Response job_thumbnail(Context& context, const Call&, const Job& job) {
    if (!job.has_thumbnail) return refused(ErrorCode::not_found, "the job's file holds no thumbnail");
    Response response = file_response(part_of(context, job, FilePart::thumbnail), "image/png");
    response.add("Cache-Control", "private, max-age=86400, immutable");
    return response;
}

/// The index of packed layers; an empty array when none were packed.
Json layers_of(Context& context, const Job& job) {
    if (!job.has_layers) return Json::array();
    const auto index = part_of(context, job, FilePart::layers_index);
    const Result<std::string> text = index ? read_whole(*index) : std::string{};
    Json layers = Json::parse(text ? *text : "", nullptr, false);
    return layers.is_array() ? layers : Json::array();
}

Response job_layers(Context& context, const Call&, const Job& job) {
    return json_response({{"layers", layers_of(context, job)}});
}

/// Layers lie one behind the other in the packed file: a range of layers is a range of bytes.
Response packed_layers(Context& context, const Call& call, const Job& job) {
    const std::string& range = call.arguments[1];
    std::string_view rest = range;
    const auto first = whole_number<std::uint32_t>(take_until(rest, '-'));
    const auto last = range.find('-') == std::string::npos ? first : whole_number<std::uint32_t>(rest);
    const Json layers = layers_of(context, job);
    if (!first || !last || *first > *last || *last >= layers.size()) {
        return refused(ErrorCode::not_found, "give layers as FIRST-LAST, both within the job");
    }
    std::uint64_t offset = 0;
    std::uint64_t length = 0;
    for (std::size_t i = 0; i <= *last; ++i) {
        (i < *first ? offset : length) += layers[i].value("bytes", std::uint64_t{0});
    }
    auto packed = part_of(context, job, FilePart::layers);
    if (!packed || packed->size() < offset + length)
        return refused(ErrorCode::not_found, "the packed layers are missing");
    Response response{.content_type = "application/octet-stream",
                      .file = FileRange{std::move(packed), offset, length}};
    response.add("Cache-Control", "private, max-age=86400, immutable");
    return response;
}

Response job_inspection(Context& context, const Call&, const Job& job) {
    const Result<std::string> report = context.spool.store().report_of(job.id);
    return report.ok() ? Response{.body = *report} : error_response(report.error());
}

Response hold_queue(Context& context, const Call&) {
    return answer(context.spool.hold_queue("held by a person"), accepted());
}

constexpr std::array kJobRoutes{
    Route{Method::get, "/api/v1/jobs", list_jobs},
    upload_route(Method::post, "/api/v1/jobs", job_created, open_multipart),
    upload_route(Method::put, "/api/v1/jobs/**", job_created, open_put),
    // PrusaLink's way to the same.
    upload_route(Method::put, "/api/v1/files/local/**", job_created, open_put),
    Route{Method::get, "/api/v1/jobs/*", of_job<get_job>},
    Route{Method::remove, "/api/v1/jobs/*", of_job<delete_job>},
    Route{Method::patch, "/api/v1/jobs/*", of_job<patch_job>},
    Route{Method::post, "/api/v1/jobs/*/start", of_job<start_job>},
    Route{Method::get, "/api/v1/jobs/*/file", of_job<job_file>},
    Route{Method::get, "/api/v1/jobs/*/thumbnail", of_job<job_thumbnail>},
    Route{Method::get, "/api/v1/jobs/*/layers", of_job<job_layers>},
    Route{Method::get, "/api/v1/jobs/*/layers/*", of_job<packed_layers>},
    Route{Method::get, "/api/v1/jobs/*/inspection", of_job<job_inspection>},
    Route{Method::post, "/api/v1/queue/hold", hold_queue},
    Route{Method::post, "/api/v1/queue/release", act<&spool::Spool::release_queue>},
};

}  // namespace

std::span<const Route> job_routes() { return kJobRoutes; }

}  // namespace qduino::web::api
