#include "web/service.h"

#include <algorithm>

#include "base/whole_number.h"
#include "web/api/json.h"

namespace qduino::web {

using api::Json;

namespace {

Plan respond(Response response) {
    Plan plan;
    plan.response = std::move(response);
    return plan;
}

Plan collect(std::size_t body_max) {
    Plan plan;
    plan.kind = Plan::Kind::collect;
    plan.body_max = body_max;
    return plan;
}

bool is_safe(Method method) { return method == Method::get || method == Method::head; }

bool is_path(const RequestHead& head, std::initializer_list<std::string_view> segments) {
    return std::equal(head.path.begin(), head.path.end(), segments.begin(), segments.end());
}

bool starts_with(const RequestHead& head, std::initializer_list<std::string_view> segments) {
    return head.path.size() >= segments.size() &&
           std::equal(segments.begin(), segments.end(), head.path.begin());
}

Response unauthorized() {
    Response response = error_response(
        401, "not_permitted",
        "this needs the key: send it as X-Api-Key, or open the link that was printed at start");
    response.add("WWW-Authenticate", "Bearer");
    return response;
}

Response too_many_tries() {
    Response response = error_response(429, "not_permitted",
                                       "this key is wrong, and it was too many wrong ones from this address");
    response.add("Retry-After", "60");
    response.close = true;  // each further guess costs a connection
    return response;
}

Response text_response(std::string body, std::string content_type) {
    Response response;
    response.content_type = std::move(content_type);
    response.body = std::move(body);
    return response;
}

bool is_true(std::string_view text) { return text == "true" || text == "1" || text == "yes" || text == "?1"; }
bool is_false(std::string_view text) {
    return text == "false" || text == "0" || text == "no" || text == "?0";
}

/// An absent field leaves `value`; a field that is no whole number is an error.
bool read_number(const std::string& text, int& value) {
    if (text.empty()) return true;
    const std::optional<int> number = whole_number<int>(text);
    value = number.value_or(value);
    return number.has_value();
}

/// An upload alone starts nothing: without print=true (or hold=false) the job waits, held.
Result<spool::NewJob> wanted_by(const Upload& upload) {
    spool::NewJob wanted;
    wanted.name = upload.name();
    wanted.hold = !is_true(upload.field("print"));
    if (is_true(upload.field("hold"))) wanted.hold = true;
    if (is_false(upload.field("hold"))) wanted.hold = false;
    if (!read_number(upload.field("copies"), wanted.copies) ||
        !read_number(upload.field("priority"), wanted.priority)) {
        return make_error(ErrorCode::invalid_argument, "copies and priority must be whole numbers");
    }
    const std::string folder = upload.field("path");
    if (folder.find("..") != std::string::npos || folder.find('\\') != std::string::npos ||
        folder.starts_with('/')) {
        return make_error(ErrorCode::invalid_argument, "path leads out of the job folder; leave it empty");
    }
    return wanted;
}

std::map<std::string, std::string> fields_of_put(const RequestHead& head) {
    std::map<std::string, std::string> fields;
    const bool print = trimmed(head.value("Print-After-Upload")) == "?1";
    fields["print"] = print ? "true" : "false";
    fields["sha256"] = trimmed(head.value("X-Content-SHA256"));
    return fields;
}

Response octoprint_created(const spool::Job& job, const std::string& host, bool print) {
    const std::string resource = "http://" + host + "/api/v1/jobs/" + std::to_string(job.id);
    const Json local{{"name", job.name},
                     {"path", job.name},
                     {"origin", "local"},
                     {"refs", {{"resource", resource}, {"download", resource + "/file"}}}};
    Response response = api::json_response({{"files", {{"local", local}}},
                                            {"done", true},
                                            {"effectiveSelect", print},
                                            {"effectivePrint", print}},
                                           201);
    response.add("Location", resource);
    return response;
}

Response violation(const spool::Analysis& analysis) {
    const bool foreign = analysis.verdict == spool::Analysis::Verdict::not_gcode;
    Json error{{"code", foreign ? "unsupported" : "out_of_range"}, {"message", analysis.message}};
    if (analysis.line > 0) error["line"] = analysis.line;
    return api::json_response({{"error", std::move(error)}}, foreign ? 415 : 422);
}

}  // namespace

Service::Service(ServiceOptions options, api::Context context, Authenticator authenticator, StaticFiles files,
                 spool::Analyzer& analyzer, Executors executors)
    : options_(std::move(options)),
      context_(std::move(context)),
      authenticator_(std::move(authenticator)),
      files_(std::move(files)),
      analyzer_(analyzer),
      executors_(std::move(executors)) {}

// ---- plan ---------------------------------------------------------------------------------------

/// The refusals that come before any route. Sets `proof` when there is none.
std::optional<Response> Service::refuse(const RequestHead& head, const std::string& remote, Moment moment,
                                        Proof& proof) {
    proof = authenticator_.prove(head, remote, moment.now, moment.now_s);
    if (proof == Proof::limited || proof == Proof::none) metrics_.count_refused_login();
    if (proof == Proof::limited) return too_many_tries();
    if (proof == Proof::none) return unauthorized();
    // A request with a key does not come from a page of another site. Any other request may.
    const bool foreign_page = proof == Proof::cookie ? !is_safe(head.method) && !is_same_origin(head, false)
                                                     : proof == Proof::off && !is_same_origin(head, true);
    if (foreign_page)
        return error_response(403, "not_permitted", "this request comes from a page of another site");
    return std::nullopt;
}

Plan Service::plan(const RequestHead& head, const std::string& remote, Moment moment) {
    if (!options_.hosts.allows(head.value("Host"))) {
        return respond(
            error_response(403, "not_permitted", "this name is not known here; allow it with --allow-host"));
    }
    if (is_path(head, {"healthz"}) && is_safe(head.method))
        return respond(text_response("ok\n", "text/plain"));
    if (is_path(head, {"api", "v1", "session"}) && head.method == Method::post) {
        if (!is_same_origin(head, true)) {
            return respond(
                error_response(403, "not_permitted", "this request comes from a page of another site"));
        }
        Plan plan = collect(4096);
        plan.proves = true;
        return plan;
    }
    if (is_path(head, {"api", "v1", "live"}) && head.method == Method::get)
        return plan_live(head, remote, moment);
    const bool guarded = starts_with(head, {"api"}) || is_path(head, {"metrics"});
    if (!guarded) {
        if (!is_safe(head.method))
            return respond(error_response(405, "not_permitted", "only GET is possible here"));
        std::optional<Response> file = files_.find(head);
        return respond(file ? std::move(*file) : error_response(404, "not_found", "there is no such page"));
    }
    Proof proof = Proof::none;
    if (std::optional<Response> refusal = refuse(head, remote, moment, proof))
        return respond(std::move(*refusal));
    std::optional<Plan> upload = plan_upload(head);
    Plan plan = upload ? std::move(*upload) : plan_route(head);
    plan.proof = proof;
    return plan;
}

Plan Service::plan_route(const RequestHead& head) {
    const bool own =
        (is_path(head, {"metrics"}) && is_safe(head.method)) ||
        (is_path(head, {"api", "v1", "session"}) && head.method == Method::remove) ||
        (is_path(head, {"api", "v1", "live-ticket"}) && head.method == Method::post) ||
        (is_path(head, {"api", "v1", "machine", "emergency-stop"}) && head.method == Method::post);
    if (own) return collect(kBodyMax);
    const api::Match match = api::find_route(head);
    if (match.handler) return collect(kBodyMax);
    if (match.path_known)
        return respond(error_response(405, "not_permitted", "this method is not possible here"));
    return respond(error_response(404, "not_found", "there is nothing of this name"));
}

/// A browser cannot add a header to a WebSocket. It shows its cookie and its page's origin, or a
/// ticket.
Plan Service::plan_live(const RequestHead& head, const std::string& remote, Moment moment) {
    if (!head.upgrades_to_websocket)
        return respond(error_response(400, "invalid_argument", "this is a WebSocket; ask for an upgrade"));
    const std::string ticket = head.query_value("ticket");
    if (!ticket.empty()) {
        if (!authenticator_.tickets.take(ticket, moment.now)) return respond(unauthorized());
        if (!is_same_origin(head, true))
            return respond(
                error_response(403, "not_permitted", "this request comes from a page of another site"));
    } else {
        Proof proof = Proof::none;
        if (std::optional<Response> refusal = refuse(head, remote, moment, proof))
            return respond(std::move(*refusal));
        if (!is_same_origin(head, proof != Proof::cookie)) {
            return respond(
                error_response(403, "not_permitted", "this request comes from a page of another site"));
        }
    }
    Plan plan;
    plan.kind = Plan::Kind::live;
    return plan;
}

/// Nothing when the request is no upload.
std::optional<Plan> Service::plan_upload(const RequestHead& head) {
    const spool::BlobStore& blobs = context_.spool.blobs();
    const bool own_post = head.method == Method::post && is_path(head, {"api", "v1", "jobs"});
    const bool octoprint = head.method == Method::post && is_path(head, {"api", "files", "local"});
    const bool own_put =
        head.method == Method::put && starts_with(head, {"api", "v1", "jobs"}) && head.path.size() >= 4;
    const bool prusalink = head.method == Method::put && starts_with(head, {"api", "v1", "files", "local"}) &&
                           head.path.size() >= 5;
    if (own_post || octoprint) {
        return admit_upload(head, make_multipart_upload(blobs, head.value("Content-Type")),
                            octoprint ? UploadDialect::octoprint : UploadDialect::own);
    }
    if (!own_put && !prusalink) return std::nullopt;
    // The rest of the path is the name. A slash in it, decoded or not, is refused with the name.
    std::string name;
    for (std::size_t i = prusalink ? 4 : 3; i < head.path.size(); ++i)
        name += (name.empty() ? "" : "/") + head.path[i];
    if (const Result<void> checked = spool::check_name(name); !checked.ok())
        return respond(refused_upload(checked.error()));
    return admit_upload(head, make_raw_upload(blobs, std::move(name), fields_of_put(head)),
                        prusalink ? UploadDialect::prusalink : UploadDialect::own);
}

Plan Service::admit_upload(const RequestHead& head, Result<std::unique_ptr<Upload>> upload,
                           UploadDialect dialect) {
    if (!upload.ok()) return respond(refused_upload(upload.error()));
    if (!head.chunked && !head.content_length) {
        return respond(error_response(411, "invalid_argument",
                                      "the upload needs Content-Length, or must come in chunks"));
    }
    // A multipart body is a little longer than its file. So the announced length is checked
    // coarsely, and the file exactly.
    constexpr std::uint64_t kWrapping = 256 * 1024;
    if (head.content_length.value_or(0) > context_.spool.blobs().limits().size_max_bytes + kWrapping) {
        return respond(error_response(413, "out_of_range", "the file is longer than this printer accepts"));
    }
    std::erase_if(uploads_, [](const std::weak_ptr<Upload>& each) { return each.expired(); });
    if (uploads_.size() >= options_.uploads_max) {
        Response busy = error_response(503, "unavailable", "too many uploads at once; try again");
        return respond(std::move(busy.add("Retry-After", "5")));
    }
    Plan plan;
    plan.kind = Plan::Kind::upload;
    plan.upload = std::move(*upload);
    plan.upload->dialect = dialect;
    uploads_.push_back(plan.upload);
    return plan;
}

// ---- handle -------------------------------------------------------------------------------------

void Service::handle(std::shared_ptr<const Request> request, Moment moment, Reply reply) {
    if (handle_at_once(*request, moment, reply)) return;
    executors_.spool([this, request = std::move(request), moment, reply = std::move(reply)] {
        Response response;
        if (is_path(request->head, {"metrics"})) {
            response =
                text_response(metrics_.text(context_.spool), "text/plain; version=0.0.4; charset=utf-8");
        } else {
            api::Match match = api::find_route(request->head);
            response = match.handler(context_, {*request, std::move(match.arguments), moment.now_s});
        }
        executors_.io([reply, response = std::move(response)]() mutable { reply(std::move(response)); });
    });
}

/// Handles requests that need no spool, or must not wait for it. False: it is for the spool's
/// thread.
bool Service::handle_at_once(const Request& request, Moment moment, const Reply& reply) {
    const RequestHead& head = request.head;
    if (is_path(head, {"api", "v1", "session"})) {
        head.method == Method::post ? begin_session(request, moment, reply) : end_session(request, reply);
        return true;
    }
    if (is_path(head, {"api", "v1", "live-ticket"})) {
        reply(api::json_response({{"ticket", authenticator_.tickets.make(moment.now)}}, 201));
        return true;
    }
    if (is_path(head, {"api", "v1", "machine", "emergency-stop"})) {
        reply(api::answer(context_.spool.emergency().stop(), api::accepted()));
        return true;
    }
    return false;
}

void Service::begin_session(const Request& request, Moment moment, const Reply& reply) {
    const std::optional<Json> body = api::object_of(request.body);
    if (!body || !body->contains("key") || !(*body)["key"].is_string()) {
        return reply(error_response(400, "invalid_argument", "give key as a text"));
    }
    const Proof proof =
        authenticator_.prove_key((*body)["key"].get<std::string>(), request.remote, moment.now);
    if (proof == Proof::limited || proof == Proof::none) metrics_.count_refused_login();
    if (proof == Proof::limited) return reply(too_many_tries());
    if (proof == Proof::none) return reply(unauthorized());
    // The old session of this browser, if any, ends: a session that an attacker fixed must not live
    // on.
    const std::string old_token{cookie_value(request.head.value("Cookie"), Authenticator::kCookie)};
    const std::string old_hash = old_token.empty() ? "" : authenticator_.sessions.end(old_token);
    const SessionTable::Made made = authenticator_.sessions.make(moment.now_s);
    Response response = api::no_content();
    response.add("Set-Cookie", std::string{Authenticator::kCookie} + "=" + made.token +
                                   "; Path=/; HttpOnly; SameSite=Strict; Max-Age=" +
                                   std::to_string(SessionTable::kLifetime_s));
    executors_.spool([this, record = made.record, old_hash, moment, reply, response = std::move(response)] {
        static_cast<void>(context_.spool.store().erase_sessions_expired(moment.now_s));
        if (!old_hash.empty()) static_cast<void>(context_.spool.store().erase_session(old_hash));
        const Result<void> stored = context_.spool.store().put_session(record);
        executors_.io(
            [reply, answer = api::answer(stored, response)]() mutable { reply(std::move(answer)); });
    });
}

void Service::end_session(const Request& request, const Reply& reply) {
    const std::string token{cookie_value(request.head.value("Cookie"), Authenticator::kCookie)};
    const std::string hash = authenticator_.sessions.end(token);
    executors_.spool([this, hash, reply] {
        const Result<void> erased = context_.spool.store().erase_session(hash);
        Response response = api::answer(erased, api::no_content());
        response.add("Set-Cookie",
                     std::string{Authenticator::kCookie} + "=; Path=/; HttpOnly; SameSite=Strict; Max-Age=0");
        executors_.io([reply, response = std::move(response)]() mutable { reply(std::move(response)); });
    });
}

// ---- uploads ------------------------------------------------------------------------------------

Response Service::refused_upload(const Error& error) {
    Response response = api::error_response(error);
    // Some refusals have words of their own for a body: too large, disk full, damaged on the way.
    if (error.code == ErrorCode::out_of_range) response.status = 413;
    if (error.code == ErrorCode::unavailable) response.status = 507;
    if (error.code == ErrorCode::corrupt) response.status = 422;
    return response;
}

void Service::take_piece(std::shared_ptr<Upload> upload, std::string piece,
                         std::function<void(Result<void>)> done) {
    executors_.disk([this, upload = std::move(upload), piece = std::move(piece), done = std::move(done)] {
        Result<void> taken = upload->take(piece);
        executors_.io([done, taken = std::move(taken)] { done(taken); });
    });
}

void Service::end_upload(std::shared_ptr<Upload> upload, std::string host, Moment moment, Reply reply) {
    executors_.disk([this, upload = std::move(upload), host = std::move(host), moment,
                     reply = std::move(reply)] {
        const Result<void> finished = upload->finish();
        if (!finished.ok()) {
            upload->discard();
            executors_.io([reply, response = refused_upload(finished.error())]() mutable {
                reply(std::move(response));
            });
            return;
        }
        metrics_.count_upload(upload->received());
        executors_.analysis([this, upload, host, moment, reply] { analyze(upload, host, moment, reply); });
    });
}

void Service::analyze(std::shared_ptr<Upload> upload, std::string host, Moment moment, Reply reply) {
    Result<spool::Analysis> analysis = analyzer_.analyze(upload->file().path(), upload->file().layers_path());
    if (!analysis.ok() || analysis->verdict != spool::Analysis::Verdict::fits) {
        Response response = analysis.ok() ? violation(*analysis) : refused_upload(analysis.error());
        upload->discard();
        executors_.io([reply, response = std::move(response)]() mutable { reply(std::move(response)); });
        return;
    }
    executors_.spool([this, upload = std::move(upload), host = std::move(host), moment,
                      reply = std::move(reply), facts = std::move(*analysis)] {
        Response response = queue_upload(*upload, facts, host, moment);
        upload->discard();  // what was adopted is no longer its own
        executors_.io([reply, response = std::move(response)]() mutable { reply(std::move(response)); });
    });
}

Response Service::queue_upload(Upload& upload, const spool::Analysis& analysis, const std::string& host,
                               Moment moment) {
    const Result<spool::NewJob> wanted = wanted_by(upload);
    if (!wanted.ok()) return api::error_response(wanted.error());
    const Result<spool::JobId> id = context_.spool.add(upload.file(), analysis, *wanted, moment.now_s);
    if (!id.ok()) return refused_upload(id.error());
    const spool::Job& job = *context_.spool.queue().find(*id);  // it has just been queued
    if (upload.dialect == UploadDialect::octoprint) return octoprint_created(job, host, !wanted->hold);
    Response response = api::json_response(api::job_json(context_.spool, job), 201);
    response.add("Location", "/api/v1/jobs/" + std::to_string(*id));
    return response;
}

void Service::report_upload(const Upload& upload, std::uint64_t size) {
    const Json message{
        {"type", "upload"}, {"name", upload.name()}, {"received", upload.received()}, {"size", size}};
    live_.publish(MessageKind::upload, api::text_of(message));
}

}  // namespace qduino::web
