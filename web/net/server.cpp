#include "web/net/server.h"

#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ip/v6_only.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/websocket.hpp>
#include <cerrno>
#include <map>
#include <set>
#include <span>
#include <thread>
#include <vector>

#include "web/http/forwarded.h"
#include "web/net/handshakes.h"
#include "web/net/resumed_socket.h"
#include "web/net/tls.h"

namespace qduino::web {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;

namespace {

constexpr std::size_t kFilePiece = 64 * 1024;
// The kernel doubles it. Its own choice goes up to megabytes a connection.
constexpr int kKernelSendBytes = 64 * 1024;
constexpr int kAnalysisNice = 10;

/// How many descriptors the process may open: raised to `wanted` where that is allowed.
std::size_t descriptors_for(std::size_t wanted) {
    rlimit limit{};
    if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return 0;
    if (limit.rlim_cur < wanted) {
        rlimit raised = limit;
        raised.rlim_cur = std::min<rlim_t>(wanted, limit.rlim_max);
        if (::setrlimit(RLIMIT_NOFILE, &raised) == 0) limit = raised;
    }
    return static_cast<std::size_t>(std::min<rlim_t>(limit.rlim_cur, wanted));
}

/// As numbers; an IPv4 address in its own form, even where the socket is IPv6.
asio::ip::address plain_address(asio::ip::address address) {
    if (address.is_v6() && address.to_v6().is_v4_mapped())
        return asio::ip::make_address_v4(asio::ip::v4_mapped, address.to_v6());
    return address;
}

/// What a browser shows that was sent without TLS to a printer that is to be reached with it.
constexpr std::string_view kOnlyTls =
    "HTTP/1.1 400 Bad Request\r\nContent-Type: text/plain\r\nConnection: close\r\n\r\n"
    "This printer is reached with TLS: write https:// in front of its address.\n";

}  // namespace

// ---- threads ------------------------------------------------------------------------------------

struct Threads::Parts {
    asio::io_context io{1};
    asio::io_context spool{1};
    asio::executor_work_guard<asio::io_context::executor_type> io_work{io.get_executor()};
    asio::executor_work_guard<asio::io_context::executor_type> spool_work{spool.get_executor()};
    asio::thread_pool disk{2};
    asio::thread_pool analysis{1};
    asio::steady_timer tick{spool};
    asio::signal_set signals{io};
    std::thread spool_thread;

    void tick_again(Nanoseconds period, const Task& task) {
        tick.expires_after(period);
        tick.async_wait([this, period, task](const error_code& failed) {
            if (failed) return;
            task();
            tick_again(period, task);
        });
    }
};

Threads::Threads() : parts_(std::make_unique<Parts>()) {
    parts_->spool_thread = std::thread{[this] { parts_->spool.run(); }};
    // On Linux a nice value belongs to the thread that sets it.
    asio::post(parts_->analysis, [] { static_cast<void>(::setpriority(PRIO_PROCESS, 0, kAnalysisNice)); });
}

Threads::~Threads() {
    stop();
    join();
}

Executors Threads::executors() {
    const auto on = [](auto& context) {
        return [&context](Task task) { asio::post(context, std::move(task)); };
    };
    return {on(parts_->io), on(parts_->spool), on(parts_->disk), on(parts_->analysis)};
}

void Threads::every(Nanoseconds period, Task task) {
    asio::post(parts_->spool, [this, period, task = std::move(task)] { parts_->tick_again(period, task); });
}

void Threads::run() { parts_->io.run(); }

void Threads::stop() { parts_->io.stop(); }

void Threads::stop_on_signals(std::function<void(int)> on_signal) {
    parts_->signals.add(SIGINT);
    parts_->signals.add(SIGTERM);
    parts_->signals.async_wait(
        [this, on_signal = std::move(on_signal)](const error_code& failed, int signal) {
            if (failed) return;
            on_signal(signal);
            stop();
        });
}

void Threads::join() {
    parts_->disk.stop();
    parts_->analysis.stop();
    parts_->disk.join();
    parts_->analysis.join();
    parts_->spool.stop();
    if (parts_->spool_thread.joinable()) parts_->spool_thread.join();
}

// ---- server -------------------------------------------------------------------------------------

class Session;
class LiveSession;

struct Server::Parts : std::enable_shared_from_this<Server::Parts> {
    Parts(ServerOptions wanted, Threads& threads, Service& its_service, std::function<Moment()> its_clock)
        : options(std::move(wanted)),
          service(its_service),
          clock(std::move(its_clock)),
          disk(threads.executors().disk),
          io(threads.parts_->io),
          acceptor(io),
          timer(io),
          door(options.door.within(descriptors_for(options.door.descriptors()))),
          tls(options.tls),
          turn_timer(io) {}

    [[nodiscard]] Result<void> open();
    void accept();
    void accept_failed(const error_code& failed);
    void accepted(tcp::socket socket);
    void check_time();
    void drop(Door::Leaver leaver);
    void give_turns();
    void become_live(const std::shared_ptr<Session>& session);

    ServerOptions options;
    Service& service;
    std::function<Moment()> clock;
    Executor disk;
    asio::io_context& io;
    tcp::acceptor acceptor;
    asio::steady_timer timer;
    Door door;
    Door::Id next_id = 1;
    std::map<Door::Id, std::shared_ptr<Session>> sessions;
    std::set<std::shared_ptr<LiveSession>> live_sessions;
    std::vector<char> read_buffer = std::vector<char>(Connection::kBodyReadMax);
    std::vector<char> write_buffer = std::vector<char>(TlsSession::kRecordMax);
    std::shared_ptr<const TlsContext> tls;  // null: nothing is encrypted
    Handshakes handshakes;
    asio::steady_timer turn_timer;
    bool turns_come = false;
};

/// A socket and its connection: moves bytes between the two, with at most one read and one write
/// under way. Where the service has a certificate, the first byte decides:
///
///   start ──► first byte ─┬─ a handshake's ──► turn ──► handshake ──► connection
///                         ├─ another, from this very computer ─────► connection, without TLS
///                         └─ another ──► a word, and the end
class Session : public std::enable_shared_from_this<Session> {
  public:
    Session(tcp::socket socket, Server::Parts& server, Door::Id id, asio::ip::address peer)
        : wire_{std::move(socket), nullptr},
          server_(server),
          id_(id),
          peer_(std::move(peer)),
          since_(server.clock().now) {}

    void start() { server_.tls ? await_first_byte() : begin(); }
    /// Its turn has come.
    void begin_handshake() {
        wire_.tls = TlsSession::make(*server_.tls, wire_.socket.native_handle());
        if (!wire_.tls) return reset();
        since_ = server_.clock().now;
        shakes_hands_ = true;
        shake_hands();
    }
    void check_time(Moment moment) {
        if (!connection_) {
            const ConnectionLimits& limits = server_.options.limits;
            const Nanoseconds limit = shakes_hands_ ? limits.handshake_time : limits.idle_time;
            if (moment.now - since_ > limit) reset();
            return;
        }
        connection_->check_time(moment);
        if (connection_->is_stalled()) return reset();
        pump();
    }
    [[nodiscard]] Connection& connection() { return *connection_; }
    [[nodiscard]] bool is_open() const { return wire_.socket.is_open(); }
    [[nodiscard]] Wire take_wire() { return std::move(wire_); }
    [[nodiscard]] Door::Id id() const { return id_; }

    void close() {
        error_code ignored;
        if (wire_.tls) wire_.tls->shut();
        wire_.socket.close(ignored);
        server_.handshakes.leave(id_);
        server_.door.leave(id_);
        server_.sessions.erase(id_);
    }
    /// Does not wait for what the peer has not taken: the kernel forgets that at once, too.
    void reset() {
        error_code ignored;
        static_cast<void>(wire_.socket.set_option(asio::socket_base::linger(true, 0), ignored));
        close();
    }

    /// Starts whatever is due. Called after every event.
    void pump() {
        if (!is_open()) return;
        if (!writing_) write_next();
        tell_door();
        if (!is_open()) return;
        if (connection_->is_live() && !writing_ && !reading_) return server_.become_live(shared_from_this());
        if (connection_->wants_close() && !writing_) {
            if (connection_->is_closed()) return close();
            if (!shut_) {
                error_code ignored;
                if (wire_.tls) wire_.tls->shut();
                wire_.socket.shutdown(tcp::socket::shutdown_send, ignored);
                shut_ = true;
            }
        }
        if (!reading_ && connection_->wants_input()) read();
    }

  private:
    /// The address and port that the client has connected to, as a Host field has them.
    [[nodiscard]] std::string reached() const {
        error_code failed;
        const tcp::endpoint local = wire_.socket.local_endpoint(failed);
        if (failed) return "localhost";
        const asio::ip::address address = plain_address(local.address());
        const std::string name = address.to_string();
        return (address.is_v6() ? "[" + name + "]" : name) + ":" + std::to_string(local.port());
    }
    void tell_door() {
        if (std::exchange(known_, connection_->is_known()) != connection_->is_known())
            server_.drop(server_.door.set_known(id_, connection_->is_known()));
        const bool busy = writing_ || !connection_->is_idle();
        if (std::exchange(busy_, busy) != busy) server_.door.set_busy(id_, busy, server_.clock().now);
    }

    void begin() {
        std::weak_ptr<Session> weak = weak_from_this();
        connection_ = std::make_shared<Connection>(
            server_.service, Peer{peer_.to_string(), wire_.tls != nullptr, reached()},
            [weak] {
                if (const std::shared_ptr<Session> self = weak.lock()) self->pump();
            },
            server_.clock(), server_.options.limits);
        pump();
    }
    /// Calls `next` on this session at the event, if it is still open then.
    template <class Next>
    void when(tcp::socket::wait_type event, Next next) {
        wire_.socket.async_wait(event, [self = shared_from_this(), next](const error_code& failed) {
            if (!self->is_open()) return;
            failed ? self->close() : (*self.*next)();
        });
    }
    void await_first_byte() { when(tcp::socket::wait_read, &Session::take_first_byte); }
    void take_first_byte() {
        unsigned char first = 0;
        error_code failed;
        const std::size_t count = wire_.socket.receive(asio::buffer(&first, 1), MSG_PEEK, failed);
        if (failed == asio::error::would_block) return await_first_byte();
        if (failed || count == 0) return close();
        if (first != kTlsFirstByte) return peer_.is_loopback() ? begin() : say_only_tls();
        server_.handshakes.wait(id_, limited_name_of(peer_.to_string()));
        server_.give_turns();
    }
    /// What was sent is taken first: a close with bytes unread would take the answer back.
    void say_only_tls() {
        error_code ignored;
        static_cast<void>(wire_.socket.read_some(asio::buffer(server_.read_buffer), ignored));
        static_cast<void>(wire_.socket.write_some(asio::buffer(kOnlyTls), ignored));
        close();
    }
    void shake_hands() {
        switch (wire_.tls->handshake()) {
            case TlsSession::Step::wants_read:
                return when(tcp::socket::wait_read, &Session::shake_hands);
            case TlsSession::Step::wants_write:
                return when(tcp::socket::wait_write, &Session::shake_hands);
            case TlsSession::Step::done:
                server_.handshakes.leave(id_);
                return begin();
            case TlsSession::Step::ended:
            case TlsSession::Step::failed:
                return close();
        }
    }

    /// Waits for bytes first: a connection that waits needs no buffer.
    void read() {
        reading_ = true;
        const auto taken = [self = shared_from_this()](const error_code& failed) {
            self->reading_ = false;
            if (!self->is_open()) return;
            failed ? self->close() : self->take_input();
        };
        if (wire_.tls && wire_.tls->has_pending())
            return asio::post(server_.io, [taken] { taken(error_code{}); });
        wire_.socket.async_wait(std::exchange(read_waits_for_, tcp::socket::wait_read), taken);
    }
    void take_input() {
        error_code failed;
        const std::size_t wanted = connection_->input_max();
        const std::size_t count = wanted > 0 ? read_some({server_.read_buffer.data(), wanted}, failed) : 0;
        if (failed == asio::error::eof) {
            connection_->receive_end();
        } else if (failed && failed != asio::error::would_block) {
            return close();
        } else if (count > 0) {
            connection_->receive({server_.read_buffer.data(), count}, server_.clock());
        }
        pump();
    }
    /// What is there; would_block: nothing is.
    std::size_t read_some(std::span<char> bytes, error_code& failed) {
        if (!wire_.tls) return wire_.socket.read_some(asio::buffer(bytes.data(), bytes.size()), failed);
        std::size_t count = 0;
        switch (wire_.tls->read(bytes, count)) {
            case TlsSession::Step::done:
                return count;
            case TlsSession::Step::wants_write:
                read_waits_for_ = tcp::socket::wait_write;
                [[fallthrough]];
            case TlsSession::Step::wants_read:
                failed = asio::error::would_block;
                return 0;
            case TlsSession::Step::ended:
                failed = asio::error::eof;
                return 0;
            case TlsSession::Step::failed:
                failed = asio::error::connection_reset;
                return 0;
        }
        return 0;
    }

    void write_next() {
        std::optional<Connection::Output> output = connection_->take_output();
        if (!output) return;
        output_ = std::move(*output);
        hold(output_.held_bytes());
        write();
    }
    void hold(std::size_t bytes) { server_.drop(server_.door.set_held(id_, bytes, server_.clock().now)); }

    /// As much of the rest as the kernel takes now.
    void write() {
        std::array<asio::const_buffer, 3> left{
            asio::buffer(output_.bytes), asio::buffer(output_.body),
            output_.shared ? asio::buffer(*output_.shared) : asio::const_buffer{}};
        std::size_t skipped = written_;
        for (asio::const_buffer& part : left) {
            const std::size_t count = std::min(skipped, part.size());
            part += count;
            skipped -= count;
        }
        writing_ = true;
        const auto taken = [self = shared_from_this()](const error_code& failed, std::size_t count) {
            self->writing_ = false;
            if (!self->is_open()) return;
            failed ? self->close() : self->on_written(count);
        };
        if (!wire_.tls) return wire_.socket.async_write_some(left, taken);
        const std::size_t size = asio::buffer_copy(asio::buffer(server_.write_buffer), left);
        std::size_t count = 0;
        switch (wire_.tls->write({server_.write_buffer.data(), size}, count)) {
            case TlsSession::Step::done:
                // Not at once: a long answer would be a deep recursion, and would stop the others.
                return asio::post(server_.io, [taken, count] { taken(error_code{}, count); });
            case TlsSession::Step::wants_write:
                return when(tcp::socket::wait_write, &Session::write);
            case TlsSession::Step::wants_read:
                return when(tcp::socket::wait_read, &Session::write);
            case TlsSession::Step::ended:
            case TlsSession::Step::failed:
                return close();
        }
    }
    void on_written(std::size_t count) {
        const Moment moment = server_.clock();
        connection_->sent_some(count, moment);
        written_ += count;
        const std::size_t shared = output_.shared ? output_.shared->size() : 0;
        if (written_ < output_.held_bytes() + shared) return write();
        written_ = 0;
        if (output_.file && output_.file->length > 0) return read_file();
        output_ = {};
        hold(0);
        connection_->sent(moment);
        pump();
    }

    /// The next piece of the file, read on a disk thread. A file that is shorter than announced
    /// ends the connection.
    void read_file() {
        writing_ = true;
        FileRange& range = *output_.file;
        const std::size_t count = static_cast<std::size_t>(std::min<std::uint64_t>(kFilePiece, range.length));
        server_.disk([self = shared_from_this(), bytes = range.bytes, offset = range.offset, count] {
            std::string piece(count, '\0');
            const Result<std::size_t> got = bytes->read_at(offset, piece);
            piece.resize(got ? *got : 0);
            asio::post(self->server_.io,
                       [self, piece = std::move(piece)]() mutable { self->send_file(std::move(piece)); });
        });
    }
    void send_file(std::string piece) {
        writing_ = false;
        if (!is_open()) return;
        if (piece.empty()) return close();
        output_.file->offset += piece.size();
        output_.file->length -= piece.size();
        output_.bytes = std::move(piece);
        output_.body.clear();
        hold(output_.held_bytes());
        write();
    }

    Wire wire_;
    Server::Parts& server_;
    Door::Id id_;
    asio::ip::address peer_;
    Instant since_;  // it came, or its handshake began
    bool shakes_hands_ = false;
    tcp::socket::wait_type read_waits_for_ = tcp::socket::wait_read;
    std::shared_ptr<Connection> connection_;
    Connection::Output output_;
    std::size_t written_ = 0;  // of output_'s memory
    bool reading_ = false;
    bool writing_ = false;
    bool shut_ = false;
    bool known_ = false;
    bool busy_ = false;
};

/// A WebSocket that listens to the hub. The client's words are read and ignored.
class LiveSession : public std::enable_shared_from_this<LiveSession> {
  public:
    /// `rest`: what was read behind the request's head.
    LiveSession(Wire wire, std::string rest, Server::Parts& server)
        : stream_(ResumedSocket{std::move(wire), std::move(rest)}), server_(server) {}

    void start(const RequestHead& head) {
        for (const Header& header : head.headers) request_.insert(header.name, header.value);
        request_.method(beast::http::verb::get);
        request_.target("/api/v1/live");
        request_.version(11);
        began_ = server_.clock().now;
        stream_.set_option(websocket::stream_base::timeout::suggested(beast::role_type::server));
        stream_.read_message_max(4096);
        stream_.text(true);
        stream_.async_accept(request_, [self = shared_from_this()](const error_code& failed) {
            if (failed) return self->end();
            self->subscribe();
        });
    }
    /// A stream does not outlive the longest session.
    void check_time(Moment moment) {
        if (moment.now - began_ > std::chrono::seconds{SessionTable::kLifetime_s})
            close(websocket::close_code::going_away);
    }

  private:
    void subscribe() {
        std::weak_ptr<LiveSession> weak = weak_from_this();
        subscription_ = server_.service.live().subscribe([weak](MessageKind kind, const Message& message) {
            if (const std::shared_ptr<LiveSession> self = weak.lock()) self->deliver(kind, message);
        });
        if (!subscription_) return close(websocket::close_code::try_again_later);
        read();
    }
    void deliver(MessageKind kind, const Message& message) {
        queue_.push(kind, message);
        if (!writing_) write();
    }
    void write() {
        if (ended_) return;
        std::optional<Message> message = queue_.pop();
        if (!message) return;
        sent_ = *message;
        writing_ = true;
        stream_.async_write(asio::buffer(*sent_),
                            [self = shared_from_this()](const error_code& failed, std::size_t) {
                                self->writing_ = false;
                                if (failed) return self->end();
                                self->write();
                            });
    }
    void read() {
        stream_.async_read(buffer_, [self = shared_from_this()](const error_code& failed, std::size_t) {
            if (failed) return self->end();
            self->buffer_.consume(self->buffer_.size());
            self->read();
        });
    }
    void close(websocket::close_code code) {
        if (ended_ || closing_) return;
        closing_ = true;
        stream_.async_close(code, [self = shared_from_this()](const error_code&) { self->end(); });
    }
    void end() {
        if (std::exchange(ended_, true)) return;
        if (subscription_) server_.service.live().unsubscribe(*subscription_);
        // Not from within the hub's loop over its subscribers: this may be its own call.
        asio::post(server_.io, [self = shared_from_this()] { self->server_.live_sessions.erase(self); });
    }

    websocket::stream<ResumedSocket> stream_;
    Server::Parts& server_;
    beast::http::request<beast::http::empty_body> request_;
    beast::flat_buffer buffer_;
    LiveQueue queue_;
    Message sent_;
    std::optional<std::uint64_t> subscription_;
    Instant began_{};
    bool writing_ = false;
    bool closing_ = false;
    bool ended_ = false;
};

Result<void> Server::Parts::open() {
    error_code failed;
    const asio::ip::address address = asio::ip::make_address(options.address, failed);
    if (failed)
        return make_error(ErrorCode::invalid_argument,
                          "give the address to listen on as numbers, e.g. 127.0.0.1");
    tcp::endpoint endpoint{address, options.port};
    // All addresses of both kinds, or of the one kind that this computer has.
    const bool all = address.is_v6() && address.is_unspecified();
    if (options.socket >= 0)
        static_cast<void>(acceptor.assign(endpoint.protocol(), options.socket, failed));
    else
        static_cast<void>(acceptor.open(endpoint.protocol(), failed));
    if (all && !failed) static_cast<void>(acceptor.set_option(asio::ip::v6_only(false), failed));
    if (all && failed) {
        endpoint.address(asio::ip::address_v4::any());
        static_cast<void>(acceptor.close(failed));
        static_cast<void>(acceptor.open(endpoint.protocol(), failed));
    }
    if (!failed) static_cast<void>(acceptor.set_option(asio::socket_base::reuse_address(true), failed));
    if (!failed) static_cast<void>(acceptor.bind(endpoint, failed));
    if (!failed) static_cast<void>(acceptor.listen(asio::socket_base::max_listen_connections, failed));
    if (!failed) return {};
    const auto where = text(options.address, " port ", options.port);
    if (failed == asio::error::address_in_use)
        return make_error(ErrorCode::already_exists, where,
                          " is taken by another program: stop it, or give another port");
    return make_error(failed == asio::error::access_denied ? ErrorCode::not_permitted : ErrorCode::internal,
                      "cannot listen on ", where, ": ", failed.message());
}

void Server::Parts::accept() {
    acceptor.async_accept([weak = weak_from_this()](const error_code& failed, tcp::socket socket) {
        const std::shared_ptr<Parts> self = weak.lock();
        if (!self || failed == asio::error::operation_aborted) return;
        if (failed) return self->accept_failed(failed);
        self->accepted(std::move(socket));
        self->accept();
    });
}

/// Most likely out of descriptors: a connection that has a place leaves for the newcomer. If none
/// can leave, the newcomer waits, without a spin.
void Server::Parts::accept_failed(const error_code& failed) {
    const bool short_of_room = failed == asio::error::no_descriptors || failed.value() == ENFILE ||
                               failed == asio::error::no_buffer_space || failed == asio::error::no_memory;
    const Door::Leaver leaver = short_of_room ? door.make_room() : std::nullopt;
    drop(leaver);
    if (leaver) return accept();
    auto pause = std::make_shared<asio::steady_timer>(io, std::chrono::milliseconds{100});
    pause->async_wait([weak = weak_from_this(), pause](const error_code&) {
        if (const std::shared_ptr<Parts> self = weak.lock()) self->accept();
    });
}

void Server::Parts::accepted(tcp::socket socket) {
    error_code failed;
    const tcp::endpoint peer = socket.remote_endpoint(failed);
    if (failed) return;
    const asio::ip::address address = plain_address(peer.address());
    static_cast<void>(socket.set_option(tcp::no_delay(true), failed));
    static_cast<void>(socket.set_option(asio::socket_base::send_buffer_size(kKernelSendBytes), failed));
    static_cast<void>(socket.non_blocking(true, failed));
    const Door::Id id = next_id++;
    drop(door.enter(id, limited_name_of(address.to_string()), clock().now));
    const auto session = std::make_shared<Session>(std::move(socket), *this, id, address);
    sessions[id] = session;
    session->start();
}

void Server::Parts::drop(Door::Leaver leaver) {
    if (!leaver) return;
    const auto at = sessions.find(*leaver);
    if (at == sessions.end()) return;
    const std::shared_ptr<Session> session = at->second;  // reset() takes it off the list
    session->reset();
}

/// Begins the handshakes whose turn it is, and comes again while others wait.
void Server::Parts::give_turns() {
    while (const std::optional<Handshakes::Turn> turn = handshakes.next(clock().now)) {
        drop(turn->leaver);
        const auto at = sessions.find(turn->id);
        if (at == sessions.end()) continue;
        const std::shared_ptr<Session> session = at->second;  // it may take itself off the list
        session->begin_handshake();
    }
    if (!handshakes.is_waited_for() || std::exchange(turns_come, true)) return;
    turn_timer.expires_after(Handshakes::kEvery);
    turn_timer.async_wait([weak = weak_from_this()](const error_code& failed) {
        const std::shared_ptr<Parts> self = weak.lock();
        if (!self || failed) return;
        self->turns_come = false;
        self->give_turns();
    });
}

void Server::Parts::check_time() {
    timer.expires_after(std::chrono::seconds{1});
    timer.async_wait([weak = weak_from_this()](const error_code& failed) {
        const std::shared_ptr<Parts> self = weak.lock();
        if (!self || failed) return;
        const Moment moment = self->clock();
        // Copies: a session that ends takes itself out of the set.
        for (const auto& [id, session] : std::vector(self->sessions.begin(), self->sessions.end()))
            if (session->is_open()) session->check_time(moment);
        for (const auto& each : std::vector(self->live_sessions.begin(), self->live_sessions.end()))
            each->check_time(moment);
        self->check_time();
    });
}

void Server::Parts::become_live(const std::shared_ptr<Session>& session) {
    const auto live =
        std::make_shared<LiveSession>(session->take_wire(), session->connection().take_rest(), *this);
    live_sessions.insert(live);
    live->start(session->connection().head());
    door.leave(session->id());
    sessions.erase(session->id());
}

Server::Server(std::shared_ptr<Parts> parts) : parts_(std::move(parts)) {}

Server::~Server() = default;

std::uint16_t Server::port() const { return parts_->acceptor.local_endpoint().port(); }

Result<std::unique_ptr<Server>> Server::listen(ServerOptions options, Threads& threads, Service& service,
                                               std::function<Moment()> clock) {
    auto parts = std::make_shared<Parts>(std::move(options), threads, service, std::move(clock));
    QDUINO_TRY(parts->open());
    parts->accept();
    parts->check_time();
    return std::unique_ptr<Server>{new Server{std::move(parts)}};
}

void Server::use(std::shared_ptr<const TlsContext> tls) {
    asio::post(parts_->io, [parts = parts_, tls = std::move(tls)]() mutable { parts->tls = std::move(tls); });
}

}  // namespace qduino::web
