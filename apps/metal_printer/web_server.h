// HTTP/1.1 over the board's sockets, for a loop with a budget: each release serves what has come.
//
//   listener ─► connections ─► web::RequestReader ─┬─ upload ─► MemoryUpload ─┐
//                                                  └─ any other ──────────────┼─► routes.h
//                              ◄── answer ────────────────────────────────────┘
//
// The limits are small, and are said in docs/metal.md. Every request but GET /healthz carries the
// key (X-Api-Key, or Authorization: Bearer), as docs/api.md has it. There is no encryption.
#pragma once

#include <array>
#include <memory>
#include <string>

#include "apps/metal_printer/memory_spool.h"
#include "apps/metal_printer/memory_upload.h"
#include "arduino/core/socket.h"
#include "web/request_reader.h"

namespace qduino::apps::metal {

class WebServer {
  public:
    static constexpr std::size_t kConnections = 8;
    /// A connection that neither brings nor takes anything for so long goes.
    static constexpr Nanoseconds kIdle = 30s;

    WebServer(MemorySpool& spool, std::string key) : spool_(spool), key_(std::move(key)) {}

    /// Error: the port is taken, or there is no network.
    [[nodiscard]] Result<void> listen(std::uint16_t port);
    /// Accepts, reads what has come, answers. Where a client takes nothing it waits a second at
    /// most, and goes on with the answer the next time.
    void serve(Instant now);

  private:
    struct Connection {
        std::shared_ptr<arduino::Socket> socket;
        web::RequestReader reader;
        std::unique_ptr<MemoryUpload> upload;
        std::optional<web::Response> refusal;  ///< instead of the answer
        /// Until it is wholly sent no further request is looked at.
        std::string answer;
        std::size_t sent = 0;  ///< of it
        bool keep_alive = true;
        Instant heard{};  ///< when it last brought or took something
    };

    void serve(Connection& connection, Instant now);
    void send_on(Connection& connection, Instant now);
    [[nodiscard]] static bool has_more_to_send(const Connection& connection) {
        return connection.sent < connection.answer.size();
    }
    [[nodiscard]] bool advance(Connection& connection);
    void begin_request(Connection& connection);
    void end_request(Connection& connection);
    [[nodiscard]] bool shows_key(const web::RequestHead& head) const;
    static void begin_answer(Connection& connection, web::Response response, bool keep_alive);

    MemorySpool& spool_;
    std::string key_;
    std::shared_ptr<arduino::Socket> listener_;
    std::array<std::unique_ptr<Connection>, kConnections> connections_;
};

}  // namespace qduino::apps::metal
