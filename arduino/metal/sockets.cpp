// The network of sketches on a machine without an operating system: lwIP's (board/metal/net).
#include <utility>

#include "arduino/libraries/network/IPAddress.h"
#include "arduino/libraries/network/interface.h"
#include "arduino/libraries/network/socket.h"
#include "board/board.h"
#include "board/metal/net/network.h"
#include "board/metal/net/tcp_sockets.h"
#include "board/metal/net/udp_sockets.h"

namespace qduino::arduino::metal {
namespace {

using arduino::Endpoint;
using board::metal::network;
using board::metal::NetworkEnd;
using board::metal::TcpSocket;
using board::metal::UdpSocket;
using SocketResult = Result<std::shared_ptr<arduino::Socket>>;

/// Sleeps in short pieces until `done`, `longest` at most. Returns what `done` says then.
template <typename Done>
bool wait_until(Nanoseconds longest, Done done) {
    board::Board& board = board::current();
    for (const Instant give_up = board.now() + longest; !done() && board.now() < give_up;)
        board.sleep_until(board.now() + 200us);
    return done();
}

Endpoint endpoint_of(const NetworkEnd& end) { return {end.address, end.port}; }

class MetalTcp final : public arduino::Socket {
  public:
    explicit MetalTcp(TcpSocket& socket) : socket_(&socket) {}
    ~MetalTcp() override { MetalTcp::close(); }
    MetalTcp(const MetalTcp&) = delete;
    MetalTcp& operator=(const MetalTcp&) = delete;

    void close() override {
        if (socket_) std::exchange(socket_, nullptr)->leave();
    }
    std::shared_ptr<Socket> accept() override {
        TcpSocket* const next = socket_ ? socket_->accept() : nullptr;
        return next ? std::make_shared<MetalTcp>(*next) : nullptr;
    }
    std::size_t send(std::span<const std::uint8_t> bytes) override {
        std::size_t sent = 0;
        const auto is_over = [&] { return socket_->state() == TcpSocket::State::over; };
        const auto moved = [&] {
            const std::size_t taken = socket_->write(bytes.subspan(sent));
            sent += taken;
            return taken > 0 || is_over();
        };
        while (socket_ && !is_over() && sent < bytes.size() && wait_until(1s, moved)) {
        }
        return sent;
    }
    bool send_to(Endpoint, std::span<const std::uint8_t>) override { return false; }
    int receive(std::span<std::uint8_t> bytes, bool peek) override {
        if (!socket_) return -1;
        const bool finished = socket_->finished();  // before the look: what came before it is there
        const std::size_t count =
            peek ? (!bytes.empty() && socket_->peek(bytes.front()) ? 1 : 0) : socket_->read(bytes);
        return count > 0 ? static_cast<int>(count) : finished ? -1 : 0;
    }
    std::optional<std::size_t> receive_from(std::span<std::uint8_t>, Endpoint&) override {
        return std::nullopt;
    }
    [[nodiscard]] int available() override { return socket_ ? static_cast<int>(socket_->available()) : 0; }
    [[nodiscard]] Endpoint local() const override {
        return socket_ ? endpoint_of(socket_->local()) : Endpoint{};
    }
    [[nodiscard]] Endpoint remote() const override {
        return socket_ ? endpoint_of(socket_->remote()) : Endpoint{};
    }

  private:
    TcpSocket* socket_;  // null: closed
};

class MetalUdp final : public arduino::Socket {
  public:
    explicit MetalUdp(UdpSocket& socket) : socket_(&socket) {}
    ~MetalUdp() override { MetalUdp::close(); }
    MetalUdp(const MetalUdp&) = delete;
    MetalUdp& operator=(const MetalUdp&) = delete;

    void close() override {
        if (socket_) std::exchange(socket_, nullptr)->leave();
    }
    std::shared_ptr<Socket> accept() override { return nullptr; }
    std::size_t send(std::span<const std::uint8_t>) override { return 0; }
    bool send_to(Endpoint to, std::span<const std::uint8_t> bytes) override {
        return socket_ && socket_->send({to.address, to.port}, bytes);
    }
    int receive(std::span<std::uint8_t>, bool) override { return -1; }
    std::optional<std::size_t> receive_from(std::span<std::uint8_t> bytes, Endpoint& from) override {
        if (!socket_) return std::nullopt;
        NetworkEnd end;
        const auto size = socket_->receive(bytes, end);
        from = endpoint_of(end);
        return size;
    }
    [[nodiscard]] int available() override { return 0; }
    [[nodiscard]] Endpoint local() const override {
        return {0, socket_ ? socket_->local_port() : std::uint16_t{0}};
    }
    [[nodiscard]] Endpoint remote() const override { return {}; }

  private:
    UdpSocket* socket_;  // null: closed
};

Error no_card() {
    return make_error(ErrorCode::unavailable,
                      "this machine has no network card that the board knows (docs/metal.md)");
}

/// `socket` when it has come to `wanted` within `longest`.
template <typename Owner, typename Socket>
SocketResult when_it_is(typename Socket::State wanted, Socket* socket, Nanoseconds longest,
                        const char* what) {
    if (!socket) return make_error(ErrorCode::unavailable, what, ": all sockets are in use");
    std::shared_ptr<arduino::Socket> owner = std::make_shared<Owner>(*socket);
    const auto decided = [&] { return socket->state() == wanted || socket->state() == Socket::State::over; };
    if (!wait_until(longest, decided)) return make_error(ErrorCode::timed_out, what, ": nobody answers");
    if (socket->state() == wanted) return owner;
    return make_error(ErrorCode::unavailable, what, ": refused, or the port is taken");
}

}  // namespace
}  // namespace qduino::arduino::metal

namespace qduino::arduino {

using namespace metal;

Result<std::shared_ptr<Socket>> connect_socket(Endpoint to, int timeout_ms) {
    if (!network.is_open()) return no_card();
    return when_it_is<MetalTcp>(TcpSocket::State::open, TcpSocket::connect({to.address, to.port}),
                                std::chrono::milliseconds{timeout_ms}, "connect");
}

Result<std::shared_ptr<Socket>> listen_socket(std::uint16_t port) {
    if (!network.is_open()) return no_card();
    return when_it_is<MetalTcp>(TcpSocket::State::listening, TcpSocket::listen(port), 1s, "listen");
}

Result<std::shared_ptr<Socket>> udp_socket(std::uint16_t port, std::optional<std::uint32_t> group) {
    if (!network.is_open()) return no_card();
    if (group) return make_error(ErrorCode::unsupported, "this board takes no packets of a multicast group");
    return when_it_is<MetalUdp>(UdpSocket::State::open, UdpSocket::open(port), 1s, "UDP");
}

std::optional<std::uint32_t> resolve(const char* host) {
    IPAddress address;
    return address.fromString(host) ? std::optional(static_cast<std::uint32_t>(address)) : std::nullopt;
}

Interface first_interface() {
    network.ask();  // in setup() its timers run no other way
    const board::metal::NetworkAddresses addresses = network.addresses();
    return {.address = addresses.own, .mask = addresses.mask, .hardware_address = network.hardware_address()};
}

std::uint32_t gateway() { return network.addresses().gateway; }
std::uint32_t name_server() { return 0; }
std::optional<int> signal_dbm() { return std::nullopt; }

}  // namespace qduino::arduino
