#include "board/metal/net/network.h"

#include <lwip/dhcp.h>
#include <lwip/etharp.h>
#include <lwip/init.h>
#include <lwip/netif.h>
#include <lwip/timeouts.h>
#include <netif/ethernet.h>

#include <algorithm>

#include "base/text.h"
#include "board/metal/computer/clock.h"
#include "board/metal/computer/instructions.h"
#include "board/metal/driver/e1000.h"
#include "board/metal/driver/virtio_net.h"
#include "board/metal/net/tcp_sockets.h"
#include "board/metal/net/udp_sockets.h"
#include "board/metal/panic.h"

namespace qduino::board::metal {
namespace {

/// Frames in one bottom half: no more, so that what waits behind it gets its turn.
constexpr int kFramesAtOnce = 64;

VirtioNet virtio_net;
E1000 e1000;
netif interface;

NetworkCard& card_of(const netif* of) { return *static_cast<NetworkCard*>(of->state); }

/// lwIP sends a frame.
err_t frame_leaves(netif* from, pbuf* frame) {
    const auto room = card_of(from).room();
    if (frame->tot_len > room.size()) return ERR_MEM;
    pbuf_copy_partial(frame, room.data(), frame->tot_len, 0);
    card_of(from).send(frame->tot_len);
    return ERR_OK;
}

void frame_came(std::span<const std::uint8_t> frame) {
    pbuf* const bytes = pbuf_alloc(PBUF_RAW, static_cast<u16_t>(frame.size()), PBUF_POOL);
    if (!bytes) return;  // as if the wire had lost it
    pbuf_take(bytes, frame.data(), static_cast<u16_t>(frame.size()));
    if (interface.input(bytes, &interface) != ERR_OK) pbuf_free(bytes);
}

err_t begin_interface(netif* begun) {
    const NetworkCard::Address& address = card_of(begun).address();
    std::copy(address.begin(), address.end(), begun->hwaddr);
    begun->hwaddr_len = static_cast<u8_t>(address.size());
    begun->mtu = 1500;
    begun->name[0] = 'e';
    begun->name[1] = 'n';
    begun->flags = NETIF_FLAG_BROADCAST | NETIF_FLAG_ETHARP | NETIF_FLAG_ETHERNET | NETIF_FLAG_LINK_UP;
    begun->output = &etharp_output;
    begun->linkoutput = &frame_leaves;
    return ERR_OK;
}

}  // namespace

void Network::open() {
    for (NetworkCard* const card :
         {static_cast<NetworkCard*>(&virtio_net), static_cast<NetworkCard*>(&e1000)}) {
        if (!card_ && card->open()) card_ = card;
    }
    if (!card_) return;
    lwip_init();
    netif_add(&interface, nullptr, nullptr, nullptr, card_, &begin_interface, &ethernet_input);
    netif_set_default(&interface);
    netif_set_up(&interface);
    dhcp_start(&interface);
    card_->add_to(device_interrupts, *this);
    ask();
}

void Network::ask() {
    if (card_ && !asked_.exchange(true)) device_interrupts.ask(*this);
}

void Network::quiet() {
    card_->interrupt(false);
    next_turn_.store(kForever, std::memory_order_relaxed);
}

void Network::serve() {
    asked_.store(false);  // what is asked from here on needs another turn
    take_turn();
    if (!card_->frame().empty()) ask();
}

void Network::take_turn() {
    int frames = 0;
    for (auto frame = card_->frame(); !frame.empty() && frames < kFramesAtOnce; frame = card_->frame()) {
        frame_came(frame);
        card_->release();
        ++frames;
    }
    const Instant now = computer_clock.now();
    TcpSocket::serve_all(now);
    UdpSocket::serve_all();
    sys_check_timeouts();
    card_->flush();
    own_.store(interface.ip_addr.addr);
    mask_.store(interface.netmask.addr);
    gateway_.store(interface.gw.addr);
    next_turn_.store(now + std::chrono::milliseconds{sys_timeouts_sleeptime()}, std::memory_order_relaxed);
    card_->interrupt(true);
}

/// For a program that has one: apps/sketch calls it when it is linked.
void open_network() { network.open(); }

}  // namespace qduino::board::metal

// ---- what lwIP asks for (net/lwip/arch/cc.h) ----------------------------------------------------

extern "C" {
std::uint32_t sys_now() {
    return static_cast<std::uint32_t>(qduino::to_ns(qduino::board::metal::computer_clock.now()) / 1'000'000);
}
void lwip_failed(const char* what) { qduino::board::metal::panic(qduino::text("lwIP: ", what)); }
/// For port and transaction numbers: the linear congruential generator of Knuth's MMIX (The Art of
/// Computer Programming 2, 3.3.4), stirred by the clock. No secret hangs on it.
std::uint32_t lwip_random() {
    static std::uint64_t state = 0;
    state = (state + qduino::board::metal::clock_count()) * 6364136223846793005u + 1442695040888963407u;
    return static_cast<std::uint32_t>(state >> 32);
}
}
