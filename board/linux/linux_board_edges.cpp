// Edges of input pins, and the I/O VCPUs that run their handlers.
#include <poll.h>

#include <algorithm>

#include "board/linux/announced_wait.h"
#include "board/linux/linux_board.h"

namespace qduino::board::linux {
namespace {

/// How often somebody who waits for edges looks whether the board stops.
constexpr Nanoseconds kEdgeWait = 50ms;
/// Edges of one look that are each handed to the handler; a storm beyond that is one call.
constexpr std::uint32_t kEdgeBurst = 64;

}  // namespace

Result<void> LinuxBoard::attach_edge(PinId pin, Edge edge, EdgeHandler handler, void* context, VcpuId io) {
    if (!driver_of(pin)) return nothing_at(pin);
    if (!handler || io < kFirstIoVcpu || io >= kVcpuLimit) {
        return make_error(ErrorCode::invalid_argument, "an edge needs a handler and an I/O VCPU to run it");
    }
    detach_edge(pin);
    PinDriver& driver = *driver_of(pin);
    if (auto watched = driver.watch_edges(pin, edge); !watched) return watched;
    EdgeWatch& watch = watches_[pin.number];
    watch.context = context;
    watch.edge = edge;
    watch.io = io;
    watch.seen = driver.edges(pin);
    watch.handler.store(handler, std::memory_order_release);
    return {};
}

void LinuxBoard::detach_edge(PinId pin) {
    if (pin.number < kPinCount) watches_[pin.number].handler.store(nullptr, std::memory_order_release);
}

void LinuxBoard::run_handlers(VcpuId io) {
    for (std::uint16_t number = 0; number < kPinCount; ++number) {
        EdgeWatch& watch = watches_[number];
        const EdgeHandler handler = watch.handler.load(std::memory_order_acquire);
        if (!handler || watch.io != io) continue;
        const EdgeCounts counts = pins_[number]->edges(PinId{number});
        std::uint32_t edges = 0;
        if (watch.edge != Edge::falling) edges += counts.rising - watch.seen.rising;
        if (watch.edge != Edge::rising) edges += counts.falling - watch.seen.falling;
        watch.seen = counts;
        for (std::uint32_t i = 0; i < std::min(edges, kEdgeBurst); ++i) handler(watch.context);
    }
}

/// Sleeps until a pin of `io` may have changed since input_changes() was `seen`.
void LinuxBoard::wait_for_edges(VcpuId io, std::uint32_t seen) {
    std::array<pollfd, kPinCount> real{};
    nfds_t real_count = 0;
    bool any_virtual = false;
    for (std::uint16_t number = 0; number < kPinCount; ++number) {
        const EdgeWatch& watch = watches_[number];
        if (!watch.handler.load(std::memory_order_acquire) || watch.io != io) continue;
        const int descriptor = pins_[number]->edge_descriptor(PinId{number});
        any_virtual |= descriptor < 0;
        if (descriptor >= 0) real[real_count++] = {descriptor, POLLIN, 0};
    }
    const AnnouncedWait wait;
    if (real_count > 0) {  // both kinds on one VCPU: the virtual ones are then looked at every millisecond
        ::poll(real.data(), real_count, any_virtual ? 1 : static_cast<int>(kEdgeWait / 1ms));
    } else if (virtual_.attached()) {
        virtual_.wait_input_change(seen, now() + kEdgeWait);
    } else {
        block_until(now() + kEdgeWait);
    }
}

void LinuxBoard::serve_edges(VcpuId io) {
    while (!stop_requested()) {
        // Before the look: a change during it is not slept over.
        const std::uint32_t seen = virtual_.attached() ? virtual_.input_changes() : 0;
        run_handlers(io);
        if (watched_) promise_until(now() + kEdgeWait);
        wait_for_edges(io, seen);
    }
}

void LinuxBoard::edge_entry(void* board) {
    static_cast<LinuxBoard*>(board)->serve_edges(VcpuThread::current_id());
}

}  // namespace qduino::board::linux
