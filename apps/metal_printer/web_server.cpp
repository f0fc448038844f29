#include "apps/metal_printer/web_server.h"

#include <algorithm>
#include <utility>

#include "apps/metal_printer/routes.h"
#include "base/text.h"
#include "web/api/answers.h"
#include "web/api/machine_json.h"
#include "web/http/origin.h"

namespace qduino::apps::metal {

using web::RequestReader;
using web::Response;

namespace {

/// For strings of equal length the time does not depend on where they differ.
bool equal_in_constant_time(std::string_view a, std::string_view b) {
    if (a.size() != b.size()) return false;
    unsigned difference = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
        difference |= static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]);
    return difference == 0;
}

std::span<const std::uint8_t> bytes_of(std::string_view text) {
    return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

constexpr std::size_t kBodyMax = 4096;

bool is_login(const web::RequestHead& head) {
    return head.method == web::Method::post && head.path == std::vector<std::string>{"api", "v1", "session"};
}

Response no_key() { return web::error_response(401, "no_key", "the request does not carry the key"); }

}  // namespace

Result<void> WebServer::listen(std::uint16_t port) {
    QDUINO_TRY_ASSIGN(listener_, arduino::listen_socket(port));
    return {};
}

void WebServer::serve(Instant now) {
    constexpr int kNewcomers = 4;  // at once: so each is looked at before others take its place
    for (int i = 0; i < kNewcomers; ++i) {
        std::shared_ptr<arduino::Socket> next = listener_->accept();
        if (!next) break;
        admit(std::move(next), now);
    }
    std::vector<web::Door::Id> served;
    for (const auto& [id, connection] : connections_) served.push_back(id);
    for (const web::Door::Id id : served) {
        const auto at = connections_.find(id);
        if (at == connections_.end()) continue;  // it gave its place to one before it
        serve(*at->second, now);
        if (at->second->socket) continue;
        door_.leave(id);
        connections_.erase(at);
    }
}

void WebServer::admit(std::shared_ptr<arduino::Socket> socket, Instant now) {
    auto connection = std::make_unique<Connection>();
    connection->id = next_id_++;
    drop(door_.enter(connection->id, std::to_string(socket->remote().address), now));
    connection->socket = std::move(socket);
    connection->heard = now;
    connections_.emplace(connection->id, std::move(connection));
}

void WebServer::drop(web::Door::Leaver leaver) {
    if (leaver) connections_.erase(*leaver);
}

void WebServer::serve(Connection& connection, Instant now) {
    std::array<std::uint8_t, 4096> piece;
    for (int pieces = 0; pieces < 16 && connection.socket; ++pieces) {
        send_on(connection, now);
        if (!connection.socket || has_more_to_send(connection)) return;
        while (!has_more_to_send(connection) && advance(connection, now)) {
        }
        if (has_more_to_send(connection)) continue;
        const int count = connection.socket->receive(piece);
        if (count < 0 || (count == 0 && now - connection.heard > kIdle)) connection.socket.reset();
        if (count <= 0) return;
        connection.heard = now;
        connection.reader.feed(
            {reinterpret_cast<const char*>(piece.data()), static_cast<std::size_t>(count)});
    }
}

void WebServer::send_on(Connection& connection, Instant now) {
    while (has_more_to_send(connection)) {
        const std::size_t taken = connection.socket->send(bytes_of(next_piece(connection)));
        connection.sent += taken;
        if (taken > 0) connection.heard = now;
        if (taken == 0 && now - connection.heard > kIdle) connection.socket.reset();
        if (taken == 0) return;
        if (!has_more_to_send(connection) && !connection.keep_alive) connection.socket.reset();
    }
}

std::string_view WebServer::next_piece(const Connection& connection) {
    constexpr std::size_t kPiece = 8192;
    const std::size_t head = connection.answer.size();
    if (connection.sent < head) return std::string_view{connection.answer}.substr(connection.sent, kPiece);
    return std::string_view{*connection.shared}.substr(connection.sent - head, kPiece);
}

/// One step of its request. False: more has to come first.
bool WebServer::advance(Connection& connection, Instant now) {
    std::string body;
    const Result<RequestReader::Progress> step = connection.reader.advance(body);
    if (!step) {
        begin_answer(connection, web::refused_request(step.error()), false);
        return false;
    }
    switch (*step) {
        case RequestReader::Progress::need_more:
            return false;
        case RequestReader::Progress::head:
            begin_request(connection, now);
            return true;
        case RequestReader::Progress::body:
            if (!connection.upload && !connection.refusal && connection.body.size() + body.size() <= kBodyMax)
                connection.body += body;
            if (connection.upload && !connection.refusal) {
                if (const Result<void> taken = connection.upload->take(body); !taken)
                    connection.refusal = web::api::error_response(taken.error());
            }
            return true;
        case RequestReader::Progress::complete:
            end_request(connection, now);
            return true;
    }
    return false;
}

void WebServer::begin_request(Connection& connection, Instant now) {
    const web::RequestHead& head = connection.reader.head();
    door_.set_busy(connection.id, true, now);
    if (is_login(head) || open_answer(head)) return;
    const bool known = shows_key(head) || has_session(head);
    drop(door_.set_known(connection.id, known));
    if (!known) {
        connection.refusal = no_key();
        return;
    }
    const std::optional<std::string> name = upload_name_of(head);
    if (!name) return;
    Result<std::unique_ptr<MemoryUpload>> upload = MemoryUpload::open(head, *name, spool_.take_place());
    if (upload)
        connection.upload = std::move(*upload);
    else
        connection.refusal = web::api::error_response(upload.error());
    constexpr std::string_view kGoOn = "HTTP/1.1 100 Continue\r\n\r\n";
    if (head.expects_continue && !connection.refusal) connection.socket->send(bytes_of(kGoOn));
}

void WebServer::end_request(Connection& connection, Instant now) {
    const web::RequestHead& head = connection.reader.head();
    Response response;
    if (connection.refusal)
        response = std::move(*connection.refusal);
    else if (connection.upload)
        response = answer_upload(spool_, connection.upload->finish());
    else if (is_login(head))
        response = begin_session(head, connection.body);
    else if (std::optional<Response> open = open_answer(head))
        response = std::move(*open);
    else
        response = answer(spool_, head);
    connection.refusal.reset();
    connection.upload.reset();
    connection.body.clear();
    const bool keep_alive = head.keep_alive && !response.close;
    begin_answer(connection, std::move(response), keep_alive);
    connection.reader.next();
    door_.set_busy(connection.id, false, now);
}

bool WebServer::shows_key(const web::RequestHead& head) const {
    const std::optional<std::string_view> shown = web::presented_key(head);
    return shown && equal_in_constant_time(*shown, key_);
}

bool WebServer::has_session(const web::RequestHead& head) const {
    return equal_in_constant_time(web::cookie_value(head.value("Cookie"), web::kSessionCookie), session_) &&
           web::HostPolicy{}.allows(head.value("Host")) &&
           web::is_same_origin(head, {.host = std::string{head.value("Host")}}, true);
}

/// What is for everybody; nothing for any other path.
std::optional<Response> WebServer::open_answer(const web::RequestHead& head) const {
    if (head.method != web::Method::get && head.method != web::Method::head) return std::nullopt;
    if (head.path == std::vector<std::string>{"healthz"})
        return Response{.content_type = "text/plain", .body = "ok"};
    return page_.find(head);
}

/// The session lasts as long as the machine is on.
Response WebServer::begin_session(const web::RequestHead& head, std::string_view body) const {
    const std::optional<web::api::Json> shown = web::api::object_of(body);
    const bool has_key = shown && shown->contains("key") && (*shown)["key"].is_string();
    if (!has_key || !web::HostPolicy{}.allows(head.value("Host")) ||
        !web::is_same_origin(head, {.host = std::string{head.value("Host")}}, true) ||
        !equal_in_constant_time((*shown)["key"].get_ref<const std::string&>(), key_))
        return no_key();
    Response response = web::api::no_content();
    response.add("Set-Cookie", text<std::string>(web::kSessionCookie, '=', session_,
                                                 "; Path=/; HttpOnly; SameSite=Strict"));
    return response;
}

void WebServer::begin_answer(Connection& connection, Response response, bool keep_alive) {
    connection.answer = web::head_bytes(response, keep_alive);
    connection.shared = nullptr;
    if (connection.reader.head().method != web::Method::head) {
        connection.answer += response.shared ? std::string{} : response.body;
        connection.shared = std::move(response.shared);
    }
    connection.sent = 0;
    connection.keep_alive = keep_alive;
}

}  // namespace qduino::apps::metal
