#include "web/service.h"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <string_view>

#include "base/whole_number.h"
#include "web/api/json.h"

namespace qduino::web {

using api::Json;

namespace {

Plan respond(Response response) { return {.response = std::move(response)}; }

/// Below one of the paths that Moonraker serves.
bool is_moonrakers(const RequestHead& head) {
    constexpr std::array<std::string_view, 5> kBegins{"server", "printer", "access", "machine", "websocket"};
    return !head.path.empty() && std::ranges::find(kBegins, head.path.front()) != kBegins.end();
}

bool is_safe(Method method) { return method == Method::get || method == Method::head; }

Response foreign_page() {
    return error_response(403, "not_permitted", "this request comes from a page of another site");
}

/// OctoPrint's words, in any case (its valid_boolean_trues), and HTTP's structured `?1`.
bool is_one_of(std::string_view text, std::initializer_list<std::string_view> words) {
    std::string lower;
    for (const char c : text.substr(0, 8))
        lower += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    return text.size() <= 8 && std::ranges::find(words, lower) != words.end();
}
bool is_true(std::string_view text) { return is_one_of(text, {"true", "1", "yes", "y", "on", "?1"}); }
bool is_false(std::string_view text) { return is_one_of(text, {"false", "0", "no", "n", "off", "?0"}); }

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
    // Moonraker has several folders; settings are not kept as jobs.
    if (const std::string root = upload.field("root"); !root.empty() && root != "gcodes")
        return make_error(ErrorCode::invalid_argument, "root must be gcodes: G-code alone is taken");
    QDUINO_TRY_ASSIGN(wanted.name, name_in_folder(upload.field("path"), upload.name()));
    for (const char* name : {"print", "hold", "prologue"}) {
        const std::string& said = upload.field(name);
        if (!said.empty() && !is_true(said) && !is_false(said))
            return make_error(ErrorCode::invalid_argument, name, " must be true or false");
    }
    wanted.hold = !is_true(upload.field("print"));
    if (is_true(upload.field("hold"))) wanted.hold = true;
    if (is_false(upload.field("hold"))) wanted.hold = false;
    if (!read_number(upload.field("copies"), wanted.copies) ||
        !read_number(upload.field("priority"), wanted.priority)) {
        return make_error(ErrorCode::invalid_argument, "copies and priority must be whole numbers");
    }
    return wanted;
}

Response violation(const spool::Analysis& analysis) {
    const bool foreign = analysis.verdict == spool::Analysis::Verdict::not_gcode;
    Json error{{"code", foreign ? "unsupported" : "out_of_range"}, {"message", analysis.message}};
    if (analysis.line > 0) error["line"] = analysis.line;
    if (!analysis.prologue.empty()) error["offer"] = {{"prologue", analysis.prologue}};
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
      executors_(std::move(executors)) {
    context_.authenticator = &authenticator_;
    if (!context_.metrics) context_.metrics = &counts_nothing_;
}

// ---- plan ---------------------------------------------------------------------------------------

/// The refusal of a request that does not show the key, or that a page of another site may have
/// made. Sets `proof` when there is none.
std::optional<Response> Service::refuse(const RequestHead& head, const Client& client, Moment moment,
                                        Proof& proof) {
    proof = authenticator_.prove(head, client.name, moment.now, moment.now_s);
    if (std::optional<Response> refusal = refusal_of(proof)) {
        context_.metrics->count_refused_login();
        return refusal;
    }
    // With a key in the request no browser page of another site can be behind it. Otherwise one may
    // be.
    const bool foreign = proof == Proof::cookie
                             ? !is_safe(head.method) && !is_same_origin(head, client, false)
                             : proof == Proof::off && !is_same_origin(head, client, true);
    return foreign ? std::optional{foreign_page()} : std::nullopt;
}

/// A browser cannot add a header to a WebSocket: it shows its cookie, and its page's origin; or a
/// ticket.
std::optional<Response> Service::refuse_stream(const RequestHead& head, const Client& client, Moment moment) {
    const std::string ticket = head.query_value("ticket");
    Proof proof = Proof::none;
    if (!ticket.empty()) {
        if (!authenticator_.tickets.take(ticket, moment.now)) return refusal_of(Proof::none);
    } else if (std::optional<Response> refusal = refuse(head, client, moment, proof)) {
        return refusal;
    }
    return is_same_origin(head, client, proof != Proof::cookie) ? std::nullopt
                                                                : std::optional{foreign_page()};
}

/// Origin is no protection of calls that act by GET: a browser sends none with them. But it always
/// says what it is, and no page can make it say otherwise.
std::optional<Response> Service::refuse_visitor(const RequestHead& head, const Client& client, Moment moment,
                                                Proof& proof) {
    if (presented_key(head)) return refuse(head, client, moment, proof);
    if (head.value("User-Agent").starts_with("Mozilla/") || head.find("Sec-Fetch-Site"))
        return foreign_page();
    proof = authenticator_.is_off()                                   ? Proof::off
            : authenticator_.visitors.admits(client.name, moment.now) ? Proof::address
                                                                      : Proof::none;
    std::optional<Response> refusal = refusal_of(proof);
    if (refusal) context_.metrics->count_refused_login();
    return refusal;
}

std::optional<Response> Service::refuse(api::Guard guard, const RequestHead& head, const Client& client,
                                        Moment moment, Proof& proof) {
    switch (guard) {
        case api::Guard::none:
            return std::nullopt;
        case api::Guard::login:
            return is_same_origin(head, client, true) ? std::nullopt : std::optional{foreign_page()};
        case api::Guard::ticket:
            return refuse_stream(head, client, moment);
        case api::Guard::address:
            return refuse_visitor(head, client, moment, proof);
        case api::Guard::key:
            break;
    }
    return refuse(head, client, moment, proof);
}

Plan Service::plan(const RequestHead& head, const Client& client, Moment moment) {
    if (!options_.hosts.allows(client.host)) {
        return respond(
            error_response(403, "not_permitted", "this name is not known here; allow it with --allow-host"));
    }
    const api::Match match = api::find_route(head);
    if (!match.path_known && (head.path.empty() || head.path.front() != "api")) return plan_file(head);
    Proof proof = Proof::none;
    if (std::optional<Response> refusal = refuse(match.guard, head, client, moment, proof))
        return respond(std::move(*refusal));
    Plan plan = plan_route(head, match, client, moment);
    plan.proof = proof;
    return plan;
}

Plan Service::plan_file(const RequestHead& head) const {
    if (is_moonrakers(head)) {
        return respond(
            error_response(404, "not_found",
                           "of Moonraker this printer speaks a slicer's upload alone: choose OctoPrint as "
                           "the host type, with the same address and this printer's key"));
    }
    if (!is_safe(head.method))
        return respond(error_response(405, "not_permitted", "only GET is possible here"));
    std::optional<Response> file = files_.find(head);
    return respond(file ? std::move(*file) : error_response(404, "not_found", "there is no such page"));
}

Plan Service::plan_route(const RequestHead& head, const api::Match& match, const Client& client,
                         Moment moment) {
    if (!match.route) {
        return respond(match.path_known
                           ? error_response(405, "not_permitted", "this method is not possible here")
                           : error_response(404, "not_found", "there is nothing of this name"));
    }
    Plan plan;
    switch (match.route->body) {
        case api::Body::none:
            return respond(match.route->handler(
                context_, {{head, {}, client}, match.arguments, moment.now_s, moment.now, nullptr}));
        case api::Body::upload:
            return admit_upload(head, match.route->open(context_.spool.files(), head, match.arguments));
        case api::Body::live:
            if (!head.upgrades_to_websocket) {
                return respond(
                    error_response(400, "invalid_argument", "this is a WebSocket; ask for an upgrade"));
            }
            plan.kind = Plan::Kind::live;
            return plan;
        case api::Body::collect:
            break;
    }
    plan.kind = Plan::Kind::collect;
    plan.proves = match.route->guard == api::Guard::login;
    plan.body_max = plan.proves ? kLoginBodyMax : kBodyMax;
    return plan;
}

Plan Service::admit_upload(const RequestHead& head, Result<std::unique_ptr<Upload>> upload) {
    if (!upload.ok()) return respond(refused_upload(upload.error()));
    if (!head.chunked && !head.content_length) {
        return respond(error_response(411, "invalid_argument",
                                      "the upload needs Content-Length, or must come in chunks"));
    }
    // A multipart body is a little longer than its file. So the announced length is checked
    // coarsely, and the file exactly.
    constexpr std::uint64_t kWrapping = 256 * 1024;
    if (head.content_length.value_or(0) > context_.spool.files().size_max_bytes() + kWrapping) {
        return respond(error_response(413, "out_of_range", "the file is longer than this printer accepts"));
    }
    if (const Result<void> room = context_.spool.storage().check_room(); !room)
        return respond(refused_upload(room.error()));
    std::erase_if(uploads_, [](const std::weak_ptr<Upload>& each) { return each.expired(); });
    if (uploads_.size() >= options_.uploads_max) {
        Response busy = error_response(503, "unavailable", "too many uploads at once; try again");
        return respond(std::move(busy.add("Retry-After", "5")));
    }
    Plan plan;
    plan.kind = Plan::Kind::upload;
    plan.upload = std::move(*upload);
    uploads_.push_back(plan.upload);
    return plan;
}

// ---- handle -------------------------------------------------------------------------------------

void Service::send(const Reply& reply, Response response) {
    executors_.io([reply, response = std::move(response)]() mutable { reply(std::move(response)); });
}

void Service::handle(std::shared_ptr<const Request> request, Moment moment, Reply reply) {
    api::Match match = api::find_route(request->head);
    if (match.route->thread == api::Thread::spool) {
        return executors_.spool(
            [this, request = std::move(request), match = std::move(match), moment, reply = std::move(reply)] {
                send(reply, match.route->handler(
                                context_, {*request, match.arguments, moment.now_s, moment.now, nullptr}));
            });
    }
    api::Later later;
    Response response = match.route->handler(
        context_, {*request, std::move(match.arguments), moment.now_s, moment.now, &later});
    if (!later) return reply(std::move(response));
    executors_.spool(
        [this, later = std::move(later), reply = std::move(reply)] { send(reply, later(context_)); });
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
                         std::function<void(std::optional<Response>)> done) {
    executors_.disk([this, upload = std::move(upload), piece = std::move(piece), done = std::move(done)] {
        const Result<void> taken = upload->take(piece);
        if (!taken.ok())
            return executors_.io([done, refusal = refused_upload(taken.error())] { done(refusal); });
        executors_.analysis([this, upload, done] {
            const std::optional<spool::Analysis> refused = upload->judge(analyzer_);
            std::optional<Response> refusal;
            if (refused) refusal = violation(*refused);
            executors_.io([done, refusal = std::move(refusal)] { done(refusal); });
        });
    });
}

void Service::end_upload(std::shared_ptr<Upload> upload, std::shared_ptr<const Request> request,
                         Moment moment, Reply reply) {
    // A visitor's minute begins behind what he has sent, however long that took.
    const api::Match match = api::find_route(request->head);
    if (match.guard == api::Guard::address && !presented_key(request->head))
        authenticator_.visitors.enter(request->client.name, moment.now);
    executors_.disk(
        [this, upload = std::move(upload), request = std::move(request), moment, reply = std::move(reply)] {
            const Result<void> finished = upload->finish();
            if (!finished.ok()) {
                upload->discard();
                return send(reply, refused_upload(finished.error()));
            }
            context_.metrics->count_upload(upload->received());
            executors_.analysis(
                [this, upload, request, moment, reply] { analyze(upload, request, moment, reply); });
        });
}

void Service::analyze(std::shared_ptr<Upload> upload, std::shared_ptr<const Request> request, Moment moment,
                      Reply reply) {
    Result<spool::Analysis> analysis = upload->verdict(analyzer_);
    const std::string said = upload->field("prologue");
    const bool wanted = is_true(said) || (options_.prologue && !is_false(said));
    if (wanted && analysis.ok() && !analysis->prologue.empty()) {
        if (const Result<void> put = upload->put_before(analysis->prologue); !put.ok()) {
            upload->discard();
            return send(reply, refused_upload(put.error()));
        }
        analysis = upload->analyze(analyzer_);
    }
    if (!analysis.ok() || analysis->verdict != spool::Analysis::Verdict::fits) {
        upload->discard();
        return send(reply, analysis.ok() ? violation(*analysis) : refused_upload(analysis.error()));
    }
    executors_.spool([this, upload = std::move(upload), request = std::move(request), moment,
                      reply = std::move(reply), facts = std::move(*analysis)] {
        Response response = queue_upload(*upload, facts, *request, moment);
        upload->discard();  // what was adopted is no longer its own
        send(reply, std::move(response));
    });
}

Response Service::queue_upload(Upload& upload, const spool::Analysis& analysis, const Request& request,
                               Moment moment) {
    const Result<spool::NewJob> wanted = wanted_by(upload);
    if (!wanted.ok()) return api::error_response(wanted.error());
    const Result<spool::JobId> id = context_.spool.add(upload.file(), analysis, *wanted, moment.now_s);
    if (!id.ok()) return refused_upload(id.error());
    const api::Match match = api::find_route(request.head);
    return match.route->handler(context_,
                                {request, {std::to_string(*id)}, moment.now_s, moment.now, nullptr});
}

void Service::report_upload(const Upload& upload, std::uint64_t size) {
    const Json message{
        {"type", "upload"}, {"name", upload.name()}, {"received", upload.received()}, {"size", size}};
    live_.publish(MessageKind::upload, api::text_of(message));
}

}  // namespace qduino::web
