// TCP for loops: what lwIP does on the network's I/O VCPU, and what a sketch calls from any VCPU,
// meet in rings of bytes.
//
//   a loop, or setup()                                the network's side: serve()
//
//   listen(port) ──── listen_asked ──────────────────► tcp_listen
//   accept() ◄─────── ring of sockets ◄────────────── somebody has connected
//   write() ────────► out, 16 KiB ───────────────────► tcp_write, as far as the other side lets
//   read() ◄───────── in, 64 KiB ◄─────────────────── what came; the window opens as it is read
//   leave() ───────── left ──────────────────────────► the rest of `out`, then tcp_close
//
// lwIP is called by serve() alone, so it needs no lock, and a loop pays for its own copies only.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <span>

#include "base/time.h"
#include "board/metal/net/network_socket.h"
#include "channel/ring_buffer.h"

struct tcp_pcb;  // lwIP's connection
struct pbuf;

namespace qduino::board::metal {

class TcpSocket final : public NetworkSocket {
  public:
    // ---- a loop's side: one caller at a time ----------------------------------------------------
    /// A socket that listens, or connects, soon; null: all are in use.
    static TcpSocket* listen(std::uint16_t port);
    static TcpSocket* connect(NetworkEnd to);
    /// The next connection of one that listens; null: none.
    TcpSocket* accept();
    /// Takes as many as there is room for, and returns how many.
    std::size_t write(std::span<const std::uint8_t> bytes);
    std::size_t read(std::span<std::uint8_t> bytes);
    [[nodiscard]] bool peek(std::uint8_t& byte);
    [[nodiscard]] std::size_t available() const { return in_.size(); }
    /// Nothing comes any more, but for what is available().
    [[nodiscard]] bool finished() const {
        return finished_.load(std::memory_order_acquire) || state() == State::over;
    }
    [[nodiscard]] NetworkEnd local() const { return local_; }
    [[nodiscard]] NetworkEnd remote() const { return remote_; }

    // ---- the network's side ---------------------------------------------------------------------
    /// All sockets do what there is to do.
    static void serve_all(Instant now);

  private:
    friend struct TcpEvents;  // what lwIP calls

    static TcpSocket* claim();
    void serve(Instant now);
    void start_listening();
    void start_connecting();
    void follow(tcp_pcb* connection);
    void take(tcp_pcb* connection);
    void send_some();
    void open_window();
    void end(Instant now);
    void close();
    void came(const pbuf* bytes);

    std::atomic<bool> finished_{false};
    NetworkEnd local_, remote_;

    // The network's side alone:
    tcp_pcb* connection_ = nullptr;
    Instant give_up_{};                   // left, and its bytes do not leave
    std::uint64_t window_announced_ = 0;  // of the bytes that came
    std::size_t staged_ = 0;              // in `stage_`, and not lwIP's yet
    std::array<std::uint8_t, 2048> stage_{};

    channel::RingBuffer<std::uint8_t, 65536> in_;  // at least lwIP's TCP_WND
    channel::RingBuffer<std::uint8_t, 16384> out_;
    channel::RingBuffer<TcpSocket*, 16> accepted_;
};

}  // namespace qduino::board::metal
