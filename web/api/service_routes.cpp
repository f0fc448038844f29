// What concerns the service itself: sessions, tickets, the live stream, metrics (docs/api.md, "The
// link with the key", "Others").
//
// The authenticator lives on the I/O thread, the journal of sessions on the spool's. A session
// counts from its login on, in memory. That it is on the disk too only lets it outlive the service:
// where the disk is full or gone, its owner must still be able to come in and put that right.
#include <array>

#include "web/api/json.h"
#include "web/api/route.h"
#include "web/authentication.h"
#include "web/http/forwarded.h"
#include "web/metrics.h"

namespace qduino::web::api {

namespace {

std::string session_cookie(std::string_view token, spool::UnixSeconds lifetime_s, const Client& client) {
    return text<std::string>(kSessionCookie, '=', token, "; Path=", client.prefix, '/',
                             client.secure ? "; Secure" : "",
                             "; HttpOnly; SameSite=Strict; Max-Age=", lifetime_s);
}

std::string_view token_of(const Call& call) {
    return cookie_value(call.request.head.value("Cookie"), kSessionCookie);
}

/// {"key":"…"}, or {"ticket":"…"} of an invitation.
Response begin_session(Context& context, const Call& call) {
    const std::optional<std::string> key = text_member(call.request.body, "key");
    const std::optional<std::string> ticket = text_member(call.request.body, "ticket");
    if (!key && !ticket) return refused(ErrorCode::invalid_argument, "give key, or ticket, as a text");
    Authenticator& authenticator = *context.authenticator;
    const bool invited = ticket && authenticator.invitations.take(*ticket, call.now);
    const Proof proof =
        invited ? Proof::key : authenticator.prove_key(key.value_or(""), call.request.client.name, call.now);
    if (std::optional<Response> refusal = refusal_of(proof)) {
        context.metrics->count_refused_login();
        return std::move(*refusal);
    }
    // The old session of this browser, if any, ends: a session fixed by someone else must not live
    // on.
    const std::string_view old_token = token_of(call);
    const std::string old_hash = old_token.empty() ? "" : authenticator.sessions.end(old_token);
    const SessionTable::Made made = authenticator.sessions.make(call.now_s);
    *call.later = [made, old_hash, client = call.request.client](Context& later) {
        spool::Store& store = later.spool.store();
        if (!old_hash.empty()) static_cast<void>(store.erase_session(old_hash));
        Response response = no_content();
        response.add("Set-Cookie", session_cookie(made.token, SessionTable::kLifetime_s, client));
        if (store.put_session(made.record))
            static_cast<void>(store.keep_sessions(SessionTable::kSessionsMax));
        return response;
    };
    return {};
}

Response end_session(Context& context, const Call& call) {
    const std::string hash = context.authenticator->sessions.end(token_of(call));
    *call.later = [hash, client = call.request.client](Context& later) {
        Response response = answer(later.spool.store().erase_session(hash), no_content());
        response.add("Set-Cookie", session_cookie("", 0, client));
        return response;
    };
    return {};
}

Response live_ticket(Context& context, const Call& call) {
    return json_response({{"ticket", context.authenticator->tickets.make(call.now)}}, 201);
}

bool is_of_this_computer(std::string_view host) {
    const bool bracket = host.starts_with('[');
    const std::string_view name =
        bracket ? host.substr(1, host.find(']') - 1) : host.substr(0, host.find(':'));
    return equal_ignoring_case(name, "localhost") || is_loopback_address(name);
}

/// An address that signs another browser in, once, and its QR code for a phone's camera.
Response invitation(Context& context, const Call& call) {
    std::string address = call.request.client.address();
    if (is_of_this_computer(call.request.client.host))
        address = context.network_address ? context.network_address() : std::string{};
    if (address.empty() || !context.qr_code)
        return refused(ErrorCode::not_found,
                       "only this computer can reach the printer: start it with ./run --lan");
    Authenticator& authenticator = *context.authenticator;
    const std::string link = authenticator.is_off()
                                 ? address + '/'
                                 : address + "/#ticket=" + authenticator.invitations.make(call.now);
    return json_response({{"url", link},
                          {"valid_s", Authenticator::kInvitationLifetime / std::chrono::seconds{1}},
                          {"qr", context.qr_code(link)}},
                         201);
}

Response metrics(Context& context, const Call&) {
    std::string text = context.metrics->text(context.spool);
    if (text.empty()) return refused(ErrorCode::not_found, "this printer counts nothing");
    return {.content_type = "text/plain; version=0.0.4; charset=utf-8", .body = std::move(text)};
}

Response health(Context& context, const Call&) {
    const std::string trouble = context.spool.storage().trouble();
    if (trouble.empty()) return {.content_type = "text/plain", .body = "ok\n"};
    return {.status = 503, .content_type = "text/plain", .body = trouble + '\n'};
}

constexpr std::array kServiceRoutes{
    Route{Method::post, "/api/v1/session", begin_session, Thread::io, Guard::login},
    Route{Method::remove, "/api/v1/session", end_session, Thread::io},
    Route{Method::post, "/api/v1/live-ticket", live_ticket, Thread::io},
    Route{Method::post, "/api/v1/invitation", invitation, Thread::io},
    Route{Method::get, "/api/v1/live", nullptr, Thread::io, Guard::ticket, Body::live},
    Route{Method::get, "/metrics", metrics},
    Route{Method::get, "/healthz", health, Thread::io, Guard::none, Body::none},
};

}  // namespace

std::span<const Route> service_routes() { return kServiceRoutes; }

}  // namespace qduino::web::api
