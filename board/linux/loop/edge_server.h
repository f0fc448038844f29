// Edges of input pins: which handler is for which, and the I/O VCPUs that run them.
//
//   attach ──► pins of I/O VCPU 33 ──► its thread:  ┌─► look at its pins, run their handlers ─┐
//              pins of I/O VCPU 34                  └── wait: for an edge, or for its bell ◄──┘
//
// What it waits for, without looking again in between:
//
//   virtual pins alone    a futex in the pins file, which the machine counts up at every change
//   real pins             poll() on their lines, and on the bell: an eventfd, which a stop rings,
//                         and a handler that is attached meanwhile
//   both on one VCPU      no call waits for both: poll(), and a look at the virtual ones each
//                         kMixedLook. The guarantee says so (note_of()).
//
// attach() and detach() may be called while the VCPUs run.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>

#include "base/fixed_vector.h"
#include "base/result.h"
#include "board/board.h"
#include "board/handler_times.h"
#include "board/linux/pin/pin_table.h"
#include "board/linux/pin/signs_of_life.h"
#include "posix/unique_fd.h"

namespace qduino::board::linux {

class EdgeServer {
  public:
    /// `pins` and `life` outlive it.
    EdgeServer(PinTable& pins, SignsOfLife& life) : pins_(pins), life_(life) {}

    /// Setup-time. Errors: invalid_argument (no such pin, no handler, `io` is no I/O VCPU), what
    /// the pin's driver says.
    Result<void> attach(PinId pin, Edge edge, EdgeHandler handler, void* context, VcpuId io);
    void detach(PinId pin);

    /// Makes the bell of `io`. Setup-time, before serve() and before a stop may come. Error: the
    /// system's.
    Result<void> open(VcpuId io);
    /// Runs the handlers of `io`, on its thread, until `stop`.
    void serve(VcpuId io, const std::atomic<bool>& stop);
    /// Wakes everybody in serve(). Async-signal-safe.
    void ring_all();

    /// How long the handlers of `io` took to come; null: it has none. Once its thread has ended.
    [[nodiscard]] const HandlerTimes* times_of(VcpuId io) const { return times_[io].get(); }
    /// When the edge came whose handler `io` runs; kForever: nobody knows. On its own thread.
    [[nodiscard]] Instant came(VcpuId io) const { return came_[io]; }
    /// What is not as it should be with the pins of `io`; empty: nothing.
    [[nodiscard]] const char* note_of(VcpuId io) const;

    /// How often a VCPU that has pins of both kinds looks at the virtual ones.
    static constexpr Nanoseconds kMixedLook = 1ms;

  private:
    struct Watch {
        std::atomic<EdgeHandler> handler{nullptr};
        void* context = nullptr;
        Edge edge = Edge::both;
        VcpuId io = kNoVcpu;
        EdgeCounts seen;  // the VCPU's own
    };
    /// The pins of one I/O VCPU, a bit each.
    struct PinSet {
        std::array<std::atomic<std::uint64_t>, kPinCount / 64> bits{};
        template <typename Visit>
        void each(Visit visit) const;
        void add(PinId pin) { bits[pin.number / 64].fetch_or(bit(pin), std::memory_order_release); }
        void remove(PinId pin) { bits[pin.number / 64].fetch_and(~bit(pin), std::memory_order_release); }
        static constexpr std::uint64_t bit(PinId pin) { return std::uint64_t{1} << (pin.number % 64); }
    };

    /// Edges of one look that are each handed to the handler; a storm beyond that is one call.
    static constexpr std::size_t kEdgeBurst = 64;
    using Burst = FixedVector<Instant, kEdgeBurst>;

    void run_handlers(VcpuId io);
    void note_edges(Burst& burst, PinId pin, Level to, std::uint32_t seen, std::uint32_t count);
    void wait(VcpuId io, std::uint32_t seen);
    void ring(VcpuId io);

    PinTable& pins_;
    SignsOfLife& life_;
    std::array<Watch, kPinCount> watches_;
    std::array<PinSet, kVcpuLimit> of_vcpu_;
    std::array<posix::UniqueFd, kVcpuLimit> bells_;
    std::array<std::unique_ptr<HandlerTimes>, kVcpuLimit> times_;
    std::array<Instant, kVcpuLimit> came_{};  // each its VCPU's own
};

}  // namespace qduino::board::linux
