// HTTP/1.1 over the board's sockets, for a loop with a budget: each release serves what has come.
//
//   listener ─► connections ─► web::RequestReader ─┬─ upload ─► MemoryUpload ─┐
//                                                  └─ any other ──────────────┼─► routes.h
//                              ◄── answer ────────────────────────────────────┘
//
// The limits are small, and are said in docs/metal.md. Every request but for GET /healthz and the
// page's files carries the key (X-Api-Key, or Authorization: Bearer), or a browser's session, as
// docs/api.md has it. There is no encryption.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "apps/metal_printer/memory_spool.h"
#include "apps/metal_printer/memory_upload.h"
#include "arduino/libraries/network/socket.h"
#include "web/http/door.h"
#include "web/http/request_reader.h"
#include "web/http/static_files.h"

namespace qduino::apps::metal {

class WebServer {
  public:
    /// Those who have shown the key have places of their own (web/http/door.h).
    static constexpr web::DoorLimits kPlaces{
        .strangers_max = 6, .strangers_of_address_max = 6, .known_max = 6};
    /// A connection that neither brings nor takes anything for so long goes.
    static constexpr Nanoseconds kIdle = 30s;

    /// `key` admits requests, and `session` a browser that has shown the key.
    WebServer(MemorySpool& spool, std::string key, std::string session, web::StaticFiles page)
        : spool_(spool), key_(std::move(key)), session_(std::move(session)), page_(std::move(page)) {}

    /// Error: the port is taken, or there is no network.
    [[nodiscard]] Result<void> listen(std::uint16_t port);
    /// Accepts, reads what has come, answers. Where a client takes nothing it waits a second at
    /// most, and goes on with the answer the next time.
    void serve(Instant now);

  private:
    struct Connection {
        web::Door::Id id = 0;
        std::shared_ptr<arduino::Socket> socket;
        web::RequestReader reader;
        std::unique_ptr<MemoryUpload> upload;
        std::optional<web::Response> refusal;  ///< instead of the answer
        std::string body;                      ///< of a request that is no upload
        /// Until both are wholly sent no further request is looked at.
        std::string answer;
        std::shared_ptr<const std::string> shared;  ///< goes behind it
        std::size_t sent = 0;                       ///< of both
        bool keep_alive = true;
        Instant heard{};  ///< when it last brought or took something
    };

    void admit(std::shared_ptr<arduino::Socket> socket, Instant now);
    void drop(web::Door::Leaver leaver);
    void serve(Connection& connection, Instant now);
    void send_on(Connection& connection, Instant now);
    [[nodiscard]] static bool has_more_to_send(const Connection& connection) {
        return connection.sent <
               connection.answer.size() + (connection.shared ? connection.shared->size() : 0);
    }
    [[nodiscard]] static std::string_view next_piece(const Connection& connection);
    [[nodiscard]] bool advance(Connection& connection, Instant now);
    void begin_request(Connection& connection, Instant now);
    void end_request(Connection& connection, Instant now);
    [[nodiscard]] bool shows_key(const web::RequestHead& head) const;
    /// A browser with a session, and on our own page.
    [[nodiscard]] bool has_session(const web::RequestHead& head) const;
    [[nodiscard]] std::optional<web::Response> open_answer(const web::RequestHead& head) const;
    [[nodiscard]] web::Response begin_session(const web::RequestHead& head, std::string_view body) const;
    static void begin_answer(Connection& connection, web::Response response, bool keep_alive);

    MemorySpool& spool_;
    std::string key_, session_;
    web::StaticFiles page_;
    std::shared_ptr<arduino::Socket> listener_;
    web::Door door_{kPlaces};
    web::Door::Id next_id_ = 1;
    std::map<web::Door::Id, std::unique_ptr<Connection>> connections_;
};

}  // namespace qduino::apps::metal
