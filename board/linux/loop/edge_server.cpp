#include "board/linux/loop/edge_server.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <bit>

#include "board/linux/kernel/cycle_clock.h"
#include "board/linux/loop/announced_wait.h"
#include "posix/system_error.h"

namespace qduino::board::linux {

template <typename Visit>
void EdgeServer::PinSet::each(Visit visit) const {
    for (std::size_t word = 0; word < bits.size(); ++word) {
        for (std::uint64_t left = bits[word].load(std::memory_order_acquire); left != 0; left &= left - 1) {
            visit(PinId{
                static_cast<std::uint16_t>(word * 64 + static_cast<std::size_t>(std::countr_zero(left)))});
        }
    }
}

Result<void> EdgeServer::attach(PinId pin, Edge edge, EdgeHandler handler, void* context, VcpuId io) {
    PinDriver& driver = pins_.at(pin);
    if (!handler || io < kFirstIoVcpu || io >= kVcpuLimit) {
        return make_error(ErrorCode::invalid_argument, "an edge needs a handler and an I/O VCPU to run it");
    }
    detach(pin);
    QDUINO_TRY(driver.watch_edges(pin, edge));
    Watch& watch = watches_[pin.number];
    watch.context = context;
    watch.edge = edge;
    watch.io = io;
    watch.seen = driver.edges(pin);
    watch.handler.store(handler, std::memory_order_release);
    of_vcpu_[io].add(pin);
    ring(io);  // it may be waiting without this pin
    return {};
}

void EdgeServer::detach(PinId pin) {
    if (pin.number >= kPinCount) return;
    Watch& watch = watches_[pin.number];
    watch.handler.store(nullptr, std::memory_order_release);
    of_vcpu_[watch.io].remove(pin);
}

// ---- bells --------------------------------------------------------------------------------------

Result<void> EdgeServer::open(VcpuId io) {
    bells_[io].reset(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
    if (!bells_[io].valid()) return posix::system_error("make", "an event for an I/O VCPU");
    times_[io] = std::make_unique<HandlerTimes>();
    return {};
}

void EdgeServer::ring(VcpuId io) {
    const std::uint64_t one = 1;
    if (bells_[io].valid()) static_cast<void>(!::write(bells_[io].get(), &one, sizeof one));
    if (pins_.virtual_pins().attached()) pins_.virtual_pins().wake_input_waiters();
}

void EdgeServer::ring_all() {
    for (VcpuId io = kFirstIoVcpu; io < kVcpuLimit; ++io) {
        if (bells_[io].valid()) ring(io);
    }
}

// ---- the VCPUs' threads -------------------------------------------------------------------------

void EdgeServer::serve(VcpuId io, const std::atomic<bool>& stop) {
    const VirtualPins& shared = pins_.virtual_pins();
    while (!stop.load(std::memory_order_acquire)) {
        // Before the look, and before the next question for a stop: neither an edge nor a bell is
        // slept over.
        const std::uint32_t seen = shared.attached() ? shared.input_changes() : 0;
        life_.progressed(io);
        run_handlers(io);
        if (stop.load(std::memory_order_acquire)) return;
        life_.idle(io);
        wait(io, seen);
    }
}

void EdgeServer::run_handlers(VcpuId io) {
    of_vcpu_[io].each([&](PinId pin) {
        Watch& watch = watches_[pin.number];
        const EdgeHandler handler = watch.handler.load(std::memory_order_acquire);
        if (!handler) return;
        const EdgeCounts counts = pins_.at(pin).edges(pin);
        Burst burst;
        if (watch.edge != Edge::falling)
            note_edges(burst, pin, Level::high, watch.seen.rising, counts.rising);
        if (watch.edge != Edge::rising)
            note_edges(burst, pin, Level::low, watch.seen.falling, counts.falling);
        watch.seen = counts;
        std::ranges::sort(burst);
        for (const Instant came : burst) {
            const Instant began = cycle_clock.now();
            came_[io] = came;
            handler(watch.context);
            times_[io]->record(came, began, cycle_clock.now());
        }
    });
}

/// The edges that came behind the first `seen` of them.
void EdgeServer::note_edges(Burst& burst, PinId pin, Level to, std::uint32_t seen, std::uint32_t count) {
    PinDriver& driver = pins_.at(pin);
    while (seen != count && !burst.full()) burst.push_back(driver.edge_instant(pin, to, ++seen));
}

/// Sleeps until a pin of `io` may have changed since input_changes() was `seen`, or until its bell.
void EdgeServer::wait(VcpuId io, std::uint32_t seen) {
    std::array<pollfd, kPinCount + 1> real{};
    real[0] = {bells_[io].get(), POLLIN, 0};
    nfds_t count = 1;
    bool any_virtual = false;
    of_vcpu_[io].each([&](PinId pin) {
        const int descriptor = pins_.at(pin).edge_descriptor(pin);
        any_virtual |= descriptor < 0;
        if (descriptor >= 0) real[count++] = {descriptor, POLLIN, 0};
    });
    const AnnouncedWait announced;
    VirtualPins& shared = pins_.virtual_pins();
    if (count == 1 && shared.attached()) return shared.wait_input_change(seen, kForever);
    ::poll(real.data(), count, any_virtual ? static_cast<int>(kMixedLook / 1ms) : -1);
    std::uint64_t rung = 0;
    static_cast<void>(!::read(bells_[io].get(), &rung, sizeof rung));
}

const char* EdgeServer::note_of(VcpuId io) const {
    bool real = false, shared = false;
    of_vcpu_[io].each([&](PinId pin) { (pins_.at(pin).edge_descriptor(pin) < 0 ? shared : real) = true; });
    return real && shared ? "real and virtual pins on one I/O VCPU: the virtual ones are looked at every 1 "
                            "ms; give them one of their own"
                          : "";
}

}  // namespace qduino::board::linux
