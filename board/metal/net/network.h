// The network: a card, lwIP above it, and the sockets of loops above that.
//
//   card ── interrupt ──► top half: the card is quiet ──► bottom half: serve()
//                                                            frames  ─► lwIP
//   a loop ── ask() ────────────────────────────────────►    sockets ─► lwIP      net/tcp_sockets.h
//   lwIP's timers ── next_turn() ───────────────────────►    timers
//                                                            frames that leave ─► card
//
// All of lwIP runs in serve(): on the I/O VCPU that `interruptsVcpu(NIC, …)` names, within its
// budget, or above every loop where a sketch names none. It is linked, and the card opened, where a
// sketch uses the network.
#pragma once

#include <atomic>
#include <cstdint>

#include "base/time.h"
#include "board/metal/core/device_interrupts.h"
#include "board/metal/driver/network_card.h"

namespace qduino::board::metal {

/// IPv4, their bytes in the network's order; 0: none yet.
struct NetworkAddresses {
    std::uint32_t own = 0, mask = 0, gateway = 0;
};

class Network final : public Device {
  public:
    /// Once, before setup(). The card starts, and asks the network for an address (DHCP). Without a
    /// card all calls do nothing.
    void open();
    [[nodiscard]] bool is_open() const { return card_ != nullptr; }
    /// What the network has given.
    [[nodiscard]] NetworkAddresses addresses() const { return {own_.load(), mask_.load(), gateway_.load()}; }
    /// The card's; zeros without one.
    [[nodiscard]] NetworkCard::Address hardware_address() const {
        return card_ ? card_->address() : NetworkCard::Address{};
    }
    /// A socket has something to do. From any VCPU, and from setup().
    void ask();

    void quiet() override;
    [[nodiscard]] Instant next_turn() const override { return next_turn_.load(std::memory_order_relaxed); }

  private:
    void serve() override;
    void take_turn();

    NetworkCard* card_ = nullptr;
    std::atomic<bool> asked_{false};
    std::atomic<Instant> next_turn_{kForever};
    std::atomic<std::uint32_t> own_{0}, mask_{0}, gateway_{0};
};

inline constinit Network network;

}  // namespace qduino::board::metal
