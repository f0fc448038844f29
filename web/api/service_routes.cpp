// What concerns the service itself: sessions, tickets, the live stream, metrics (docs/api.md, "The
// link with the key", "Others").
//
// The authenticator lives on the I/O thread, the journal of sessions on the spool's: a login is
// answered from the second, when the session is on the disk.
#include <array>

#include "web/api/json.h"
#include "web/api/route.h"
#include "web/authentication.h"
#include "web/metrics.h"

namespace qduino::web::api {

namespace {

std::string session_cookie(std::string_view token, spool::UnixSeconds lifetime_s) {
    return text<std::string>(kSessionCookie, '=', token,
                             "; Path=/; HttpOnly; SameSite=Strict; Max-Age=", lifetime_s);
}

std::string_view token_of(const Call& call) {
    return cookie_value(call.request.head.value("Cookie"), kSessionCookie);
}

Response begin_session(Context& context, const Call& call) {
    const std::optional<std::string> key = text_member(call.request.body, "key");
    if (!key) return refused(ErrorCode::invalid_argument, "give key as a text");
    Authenticator& authenticator = *context.authenticator;
    const Proof proof = authenticator.prove_key(*key, call.request.remote, call.now);
    if (std::optional<Response> refusal = refusal_of(proof)) {
        context.metrics->count_refused_login();
        return std::move(*refusal);
    }
    // The old session of this browser, if any, ends: a session fixed by someone else must not live
    // on.
    const std::string_view old_token = token_of(call);
    const std::string old_hash = old_token.empty() ? "" : authenticator.sessions.end(old_token);
    const SessionTable::Made made = authenticator.sessions.make(call.now_s);
    *call.later = [made, old_hash, now_s = call.now_s](Context& later) {
        spool::Store& store = later.spool.store();
        static_cast<void>(store.erase_sessions_expired(now_s));
        if (!old_hash.empty()) static_cast<void>(store.erase_session(old_hash));
        Response response = no_content();
        response.add("Set-Cookie", session_cookie(made.token, SessionTable::kLifetime_s));
        return answer(store.put_session(made.record), std::move(response));
    };
    return {};
}

Response end_session(Context& context, const Call& call) {
    const std::string hash = context.authenticator->sessions.end(token_of(call));
    *call.later = [hash](Context& later) {
        Response response = answer(later.spool.store().erase_session(hash), no_content());
        response.add("Set-Cookie", session_cookie("", 0));
        return response;
    };
    return {};
}

Response live_ticket(Context& context, const Call& call) {
    return json_response({{"ticket", context.authenticator->tickets.make(call.now)}}, 201);
}

Response metrics(Context& context, const Call&) {
    return {.content_type = "text/plain; version=0.0.4; charset=utf-8",
            .body = context.metrics->text(context.spool)};
}

Response health(Context&, const Call&) { return {.content_type = "text/plain", .body = "ok\n"}; }

constexpr std::array kServiceRoutes{
    Route{Method::post, "/api/v1/session", begin_session, Thread::io, Guard::login},
    Route{Method::remove, "/api/v1/session", end_session, Thread::io},
    Route{Method::post, "/api/v1/live-ticket", live_ticket, Thread::io},
    Route{Method::get, "/api/v1/live", nullptr, Thread::io, Guard::ticket, Body::live},
    Route{Method::get, "/metrics", metrics},
    Route{Method::get, "/healthz", health, Thread::io, Guard::none, Body::none},
};

}  // namespace

std::span<const Route> service_routes() { return kServiceRoutes; }

}  // namespace qduino::web::api
