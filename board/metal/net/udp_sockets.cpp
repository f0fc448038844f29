#include "board/metal/net/udp_sockets.h"

#include <lwip/udp.h>

#include <algorithm>

#include "board/metal/net/network.h"

namespace qduino::board::metal {
namespace {

constinit std::array<UdpSocket, 4> sockets;

}  // namespace

// ---- a loop's side ------------------------------------------------------------------------------

UdpSocket* UdpSocket::open(std::uint16_t port) {
    UdpSocket* const socket = claim_one_of(sockets);
    if (!socket) return nullptr;
    socket->in_.discard_all();
    socket->out_.discard_all();
    socket->local_port_ = port;
    socket->ask(State::listen_asked);
    return socket;
}

bool UdpSocket::send(NetworkEnd to, std::span<const std::uint8_t> bytes) {
    if (bytes.size() > kPacketMax || state() != State::open) return false;
    leaving_.other = to;
    leaving_.size = static_cast<std::uint16_t>(bytes.size());
    std::ranges::copy(bytes, leaving_.bytes.begin());
    const bool taken = out_.try_push(leaving_);
    network.ask();
    return taken;
}

std::optional<std::size_t> UdpSocket::receive(std::span<std::uint8_t> bytes, NetworkEnd& from) {
    const Packet* const next = in_.front();
    if (!next) return std::nullopt;
    from = next->other;
    const std::size_t size = std::min<std::size_t>(bytes.size(), next->size);
    std::copy_n(next->bytes.begin(), size, bytes.begin());
    in_.pop();
    return size;
}

// ---- the network's side -------------------------------------------------------------------------

void UdpSocket::serve_all() {
    for (UdpSocket& socket : sockets) socket.serve();
}

void UdpSocket::serve() {
    switch (state()) {
        case State::listen_asked:
            return bind();
        case State::open:
            return send_all();
        case State::left:
            if (connection_) send_all();
            if (connection_) udp_remove(connection_);
            connection_ = nullptr;
            return set_free();
        default:
            return;
    }
}

void UdpSocket::bind() {
    connection_ = udp_new();
    const bool bound = connection_ && udp_bind(connection_, IP_ADDR_ANY, local_port_) == ERR_OK;
    if (bound) {
        local_port_ = connection_->local_port;
        const auto receive = [](void* socket, udp_pcb*, pbuf* bytes, const ip_addr_t* from, u16_t port) {
            static_cast<UdpSocket*>(socket)->came(bytes, {from->addr, port});
            pbuf_free(bytes);
        };
        udp_recv(connection_, receive, this);
    }
    move_on(State::listen_asked, bound ? State::open : State::over);
}

void UdpSocket::send_all() {
    while (const Packet* const packet = out_.front()) {
        pbuf* const bytes = pbuf_alloc(PBUF_TRANSPORT, packet->size, PBUF_RAM);
        if (!bytes) return;  // the next turn tries again
        pbuf_take(bytes, packet->bytes.data(), packet->size);
        const ip4_addr_t to{packet->other.address};
        udp_sendto(connection_, bytes, &to, packet->other.port);
        pbuf_free(bytes);
        out_.pop();
    }
}

void UdpSocket::came(pbuf* bytes, NetworkEnd from) {
    if (bytes->tot_len > kPacketMax) return;
    arriving_.other = from;
    arriving_.size = bytes->tot_len;
    pbuf_copy_partial(bytes, arriving_.bytes.data(), bytes->tot_len, 0);
    static_cast<void>(in_.try_push(arriving_));
}

}  // namespace qduino::board::metal
