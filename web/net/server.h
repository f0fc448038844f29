// Sockets and threads around the sans-I/O parts. The only translation unit with Boost.Asio's
// sockets and WebSocket in it.
//
//   I/O thread (run())      accepts, reads, writes; connections, live streams
//   spool's thread          journal, link, handlers; ticks
//   2 disk threads          pieces of uploads, sync, reads of files to be sent
//   1 analysis thread       preflight of uploads, at lower priority: it must not disturb anything
//
// No peer can make the memory grow without bound. A connection that waits has no buffer: all share
// one, and bytes are read when they are there. A connection that is served has what connection.h
// allows. door.h bounds the number of connections, and the bytes that wait to be sent to all of
// them. The kernel's own buffer of unsent bytes is small. A newcomer is always accepted: when
// descriptors run out, too, another connection leaves for it. Half-open connections are the
// kernel's (its SYN cookies): they take nothing here.
//
// With a certificate, one port takes both: a connection that begins a TLS handshake gets it
// (handshakes.h bounds them), and one from this very computer may speak plainly. Any other is told
// to come with https://.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "base/result.h"
#include "web/connection.h"
#include "web/http/door.h"
#include "web/net/tls.h"
#include "web/service.h"

namespace qduino::web {

/// The threads. Destroy them after everything that runs on them has been told to end, and before
/// what the tasks refer to.
class Threads {
  public:
    Threads();
    ~Threads();
    [[nodiscard]] Executors executors();
    /// Calls `task` on the spool's thread every `period` until stop(). Once, before run().
    void every(Nanoseconds period, Task task);
    /// Serves the I/O thread: the caller's. Returns after stop().
    void run();
    /// Any thread, and the handler of a signal that run() delivers.
    void stop();
    /// SIGINT and SIGTERM stop; `on_signal` is called on the I/O thread first.
    void stop_on_signals(std::function<void(int)> on_signal);
    /// Waits until no task runs any more. After run() has returned.
    void join();

  private:
    friend class Server;
    struct Parts;
    std::unique_ptr<Parts> parts_;
};

struct ServerOptions {
    std::string address = "127.0.0.1";
    std::uint16_t port = 0;                   ///< 0: any free one
    std::shared_ptr<const TlsContext> tls{};  ///< null: nothing is encrypted
    /// A stream socket for `address`, neither bound nor listening; −1: one is made. It belongs to
    /// the network in which it was made, which the process may have left (rights/own_view.h).
    int socket = -1;
    DoorLimits door;  ///< fewer, when descriptors are few
    ConnectionLimits limits;
};

class Server {
  public:
    /// Listens. Errors: invalid_argument (no address), already_exists (port in use), not_permitted,
    /// internal.
    [[nodiscard]] static Result<std::unique_ptr<Server>> listen(ServerOptions options, Threads& threads,
                                                                Service& service,
                                                                std::function<Moment()> clock);
    ~Server();
    [[nodiscard]] std::uint16_t port() const;
    /// Connections from now on get this certificate. Any thread. Contract: listen() got one, too.
    void use(std::shared_ptr<const TlsContext> tls);

    struct Parts;  // what its sessions see

  private:
    explicit Server(std::shared_ptr<Parts> parts);
    std::shared_ptr<Parts> parts_;
};

}  // namespace qduino::web
