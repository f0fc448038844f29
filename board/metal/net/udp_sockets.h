// UDP for loops: packets cross between a loop and the network's side in two rings, as the bytes of
// TCP do (net/tcp_sockets.h).
//
//   open(port) ───► udp_bind           send() ──► out, 8 packets ──► udp_sendto
//   leave() ──────► udp_remove         receive() ◄── in, 8 packets ◄── what came; more is lost
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <span>

#include "board/metal/net/network_socket.h"
#include "channel/ring_buffer.h"

struct udp_pcb;
struct pbuf;

namespace qduino::board::metal {

class UdpSocket final : public NetworkSocket {
  public:
    /// What a frame has room for.
    static constexpr std::size_t kPacketMax = 1472;

    // ---- a loop's side: one caller at a time ----------------------------------------------------
    /// A socket of `port`, soon; 0: one that is free. Null: all are in use.
    static UdpSocket* open(std::uint16_t port);
    /// False: too long, or no room now.
    [[nodiscard]] bool send(NetworkEnd to, std::span<const std::uint8_t> bytes);
    /// The next packet, cut to `bytes`; none when none is there.
    [[nodiscard]] std::optional<std::size_t> receive(std::span<std::uint8_t> bytes, NetworkEnd& from);
    [[nodiscard]] std::uint16_t local_port() const { return local_port_; }

    // ---- the network's side ---------------------------------------------------------------------
    static void serve_all();

  private:
    struct Packet {
        NetworkEnd other;
        std::uint16_t size = 0;
        std::array<std::uint8_t, kPacketMax> bytes{};
    };

    void serve();
    void bind();
    void send_all();
    void came(pbuf* bytes, NetworkEnd from);

    std::uint16_t local_port_ = 0;
    udp_pcb* connection_ = nullptr;
    Packet arriving_, leaving_;  // while they are put together
    channel::RingBuffer<Packet, 8> in_, out_;
};

}  // namespace qduino::board::metal
