#include "board/metal/net/tcp_sockets.h"

#include <lwip/tcp.h>

#include <algorithm>

#include "board/metal/net/network.h"

namespace qduino::board::metal {
namespace {

constexpr Nanoseconds kPatience = 20s;  // with one who takes nothing
constexpr std::size_t kSockets = 24;

constinit std::array<TcpSocket, kSockets> sockets;

static_assert(TCP_WND <= 65536, "what may come fits into `in`");

}  // namespace

/// What lwIP calls. `socket` is what tcp_arg() was given; null: nobody's any more.
struct TcpEvents {
    static err_t accepted(void* listener, tcp_pcb* connection, err_t error) {
        if (error != ERR_OK || !connection) return ERR_VAL;
        TcpSocket* const socket = TcpSocket::claim();
        if (!socket) {
            tcp_abort(connection);
            return ERR_ABRT;
        }
        socket->take(connection);
        if (!static_cast<TcpSocket*>(listener)->accepted_.try_push(socket)) socket->leave();
        return ERR_OK;
    }
    static err_t connected(void* socket, tcp_pcb* connection, err_t) {
        static_cast<TcpSocket*>(socket)->take(connection);
        return ERR_OK;
    }
    static err_t received(void* socket, tcp_pcb*, pbuf* bytes, err_t) {
        auto& self = *static_cast<TcpSocket*>(socket);
        if (!bytes) {
            self.finished_.store(true, std::memory_order_release);
            return ERR_OK;
        }
        self.came(bytes);
        pbuf_free(bytes);
        return ERR_OK;
    }
    /// lwIP has already forgotten the connection.
    static void failed(void* socket, err_t) {
        auto& self = *static_cast<TcpSocket*>(socket);
        self.connection_ = nullptr;
        self.move_on(TcpSocket::State::connecting, TcpSocket::State::over);
        self.move_on(TcpSocket::State::open, TcpSocket::State::over);
    }
};

// ---- a loop's side ------------------------------------------------------------------------------

TcpSocket* TcpSocket::claim() {
    TcpSocket* const socket = claim_one_of(sockets);
    if (!socket) return nullptr;
    socket->finished_.store(false, std::memory_order_relaxed);
    socket->in_.discard_all();
    socket->out_.discard_all();
    socket->accepted_.discard_all();
    socket->window_announced_ = socket->in_.pushed();
    socket->staged_ = 0;
    socket->give_up_ = kForever;
    return socket;
}

TcpSocket* TcpSocket::listen(std::uint16_t port) {
    TcpSocket* const socket = claim();
    if (!socket) return nullptr;
    socket->local_ = {.address = 0, .port = port};
    socket->ask(State::listen_asked);
    return socket;
}

TcpSocket* TcpSocket::connect(NetworkEnd to) {
    TcpSocket* const socket = claim();
    if (!socket) return nullptr;
    socket->remote_ = to;
    socket->ask(State::connect_asked);
    return socket;
}

TcpSocket* TcpSocket::accept() {
    TcpSocket* next = nullptr;
    return accepted_.try_pop(next) ? next : nullptr;
}

std::size_t TcpSocket::write(std::span<const std::uint8_t> bytes) {
    if (state() != State::open) return 0;
    const std::size_t taken = out_.push_some(bytes);
    network.ask();
    return taken;
}

std::size_t TcpSocket::read(std::span<std::uint8_t> bytes) {
    constexpr std::size_t kWorthwhile = 16 * 1024;
    const std::size_t held = in_.size();
    const std::size_t taken = in_.pop_some(bytes);
    // The other side may have stopped because of what was held.
    if (taken > 0 && (taken >= held || held / kWorthwhile != (held - taken) / kWorthwhile)) network.ask();
    return taken;
}

bool TcpSocket::peek(std::uint8_t& byte) {
    const std::uint8_t* const next = in_.front();
    if (next) byte = *next;
    return next != nullptr;
}

// ---- the network's side -------------------------------------------------------------------------

void TcpSocket::serve_all(Instant now) {
    for (TcpSocket& socket : sockets) socket.serve(now);
}

void TcpSocket::serve(Instant now) {
    switch (state()) {
        case State::listen_asked:
            return start_listening();
        case State::connect_asked:
            return start_connecting();
        case State::open:
            send_some();
            return open_window();
        case State::left:
            return end(now);
        default:
            return;
    }
}

void TcpSocket::start_listening() {
    tcp_pcb* const bound = tcp_new();
    const bool has_port = bound && tcp_bind(bound, IP_ADDR_ANY, local_.port) == ERR_OK;
    tcp_pcb* const listener = has_port ? tcp_listen(bound) : nullptr;
    if (!listener) {
        if (bound) tcp_abort(bound);
        move_on(State::listen_asked, State::over);
        return;
    }
    connection_ = listener;
    local_.port = listener->local_port;
    tcp_arg(listener, this);
    tcp_accept(listener, &TcpEvents::accepted);
    move_on(State::listen_asked, State::listening);
}

void TcpSocket::start_connecting() {
    tcp_pcb* const connection = tcp_new();
    const ip4_addr_t address{remote_.address};
    if (!connection) {
        move_on(State::connect_asked, State::over);
        return;
    }
    follow(connection);
    move_on(State::connect_asked, State::connecting);
    if (tcp_connect(connection, &address, remote_.port, &TcpEvents::connected) == ERR_OK) return;
    connection_ = nullptr;
    tcp_err(connection, nullptr);
    tcp_abort(connection);
    move_on(State::connecting, State::over);
}

/// lwIP tells of `connection` from now on.
void TcpSocket::follow(tcp_pcb* connection) {
    connection_ = connection;
    tcp_arg(connection, this);
    tcp_recv(connection, &TcpEvents::received);
    tcp_err(connection, &TcpEvents::failed);
}

/// A connection has come to be.
void TcpSocket::take(tcp_pcb* connection) {
    local_ = {connection->local_ip.addr, connection->local_port};
    remote_ = {connection->remote_ip.addr, connection->remote_port};
    follow(connection);
    move_on(State::claimed, State::open);
    move_on(State::connecting, State::open);
}

void TcpSocket::came(const pbuf* bytes) {
    if (state() == State::left) return;
    for (const pbuf* piece = bytes; piece; piece = piece->next)
        in_.push_some({static_cast<const std::uint8_t*>(piece->payload), piece->len});
}

void TcpSocket::send_some() {
    while (connection_) {
        const auto room = std::min<std::size_t>(stage_.size(), tcp_sndbuf(connection_));
        if (staged_ == 0) staged_ = out_.pop_some(std::span(stage_).first(room));
        if (staged_ == 0) break;
        // Without room lwIP says so; what the other side acknowledges makes some.
        if (tcp_write(connection_, stage_.data(), static_cast<u16_t>(staged_), TCP_WRITE_FLAG_COPY) != ERR_OK)
            break;
        staged_ = 0;
    }
    if (connection_) tcp_output(connection_);
}

void TcpSocket::open_window() {
    const std::uint64_t read = in_.popped() - window_announced_;
    if (!connection_ || read == 0) return;
    tcp_recved(connection_, static_cast<u16_t>(read));
    window_announced_ += read;
}

void TcpSocket::end(Instant now) {
    for (TcpSocket* waiting = nullptr; accepted_.try_pop(waiting);) waiting->leave();
    const bool listens = connection_ && connection_->state == LISTEN;
    if (connection_ && !listens) {
        // With what was not taken the connection would be reset, and the other side might lose the
        // answer: so all counts as taken.
        tcp_recved(connection_, TCP_WND);
        send_some();
        if (give_up_ == kForever) give_up_ = now + kPatience;
        if (connection_ && (staged_ > 0 || !out_.empty()) && now < give_up_) return;
    }
    if (connection_) close();
    set_free();
}

void TcpSocket::close() {
    tcp_pcb* const connection = connection_;
    connection_ = nullptr;
    tcp_arg(connection, nullptr);
    if (connection->state != LISTEN) {
        tcp_recv(connection, nullptr);
        tcp_err(connection, nullptr);
    }
    if (tcp_close(connection) != ERR_OK) tcp_abort(connection);
}

}  // namespace qduino::board::metal
