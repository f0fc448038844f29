// What sockets of TCP and UDP have in common: a state that a loop and the network's side move on.
//
//        claim            done               the other side, or an error
//   free ─────► …_asked ─────► open, listening ─────────────────────► over
//    ▲                             └───────────── leave() ─────┬───────┘
//    └──────────────────────────── ended ◄──────── left ◄──────┘
#pragma once

#include <atomic>
#include <cstdint>

#include "board/metal/net/network.h"

namespace qduino::board::metal {

/// One end of a connection, or of a packet's way: an IPv4 address, its bytes in the network's
/// order, and a port.
struct NetworkEnd {
    std::uint32_t address = 0;
    std::uint16_t port = 0;
};

class NetworkSocket {
  public:
    enum class State { free, claimed, listen_asked, connect_asked, connecting, listening, open, over, left };

    [[nodiscard]] State state() const { return state_.load(std::memory_order_acquire); }
    /// The caller has done with it; what was written is sent yet.
    void leave() { ask(State::left); }

  protected:
    /// From either side: whoever moves it on from `free` has it alone until it is asked, or open.
    template <typename Sockets>
    static typename Sockets::value_type* claim_one_of(Sockets& sockets) {
        for (auto& socket : sockets) {
            if (socket.move_on(State::free, State::claimed)) return &socket;
        }
        return nullptr;
    }
    /// False: it was in another state.
    bool move_on(State from, State to) {
        return state_.compare_exchange_strong(from, to, std::memory_order_acq_rel);
    }
    /// A loop wants something of the network's side.
    void ask(State wanted) {
        state_.store(wanted, std::memory_order_release);
        network.ask();
    }
    /// The network's side has done with it, too.
    void set_free() { state_.store(State::free, std::memory_order_release); }

  private:
    std::atomic<State> state_{State::free};
};

}  // namespace qduino::board::metal
