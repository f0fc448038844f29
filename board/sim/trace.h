// What happened, in order: for people (a sink) and for comparing two runs (a hash).
#pragma once

#include <bit>
#include <cstdint>
#include <string_view>

#include "base/time.h"
#include "board/types.h"

namespace qduino::board::sim {

enum class TraceKind : std::uint8_t {
    release,    ///< a loop's release began (told by the runtime), or an I/O VCPU was given work
    run,        ///< the core turned to this VCPU
    preempt,    ///< the VCPU lost the core, ready to go on
    block,      ///< the VCPU gave the core up: it sleeps, or has no work
    throttle,   ///< its budget is spent
    replenish,  ///< it has budget again
    overrun,    ///< a release ended after the next should have begun (told by the runtime)
    interrupt,  ///< a top half began on this core; vcpu is the device class
    finish,     ///< its entry returned
};

struct TraceEvent {
    Instant time;
    std::uint8_t core = 0;
    VcpuId vcpu = kNoVcpu;
    TraceKind kind = TraceKind::run;
};

/// What interrupted, by an event's `vcpu`: the word of its class, or "tick".
inline std::string_view interrupt_name(VcpuId device_class) {
    const auto device = static_cast<DeviceClass>(device_class);
    return device == DeviceClass::all ? "tick" : kDeviceNames(device);
}

/// Receives events in order of time, on the simulator's thread. Must not call the board.
class TraceSink {
  public:
    virtual ~TraceSink() = default;
    virtual void on_event(const TraceEvent& event) = 0;

    // What only a picture needs; it is not part of the hash.
    /// The budget that the VCPU of the event to come has left, Nanoseconds::max() for one that is
    /// never throttled. Not told of interrupts.
    virtual void on_budget(Nanoseconds /*left*/) {}
    /// The VCPU wants its core from `now` on: it woke, or was given work or a lock.
    virtual void on_ready(Instant /*now*/, int /*core*/, VcpuId /*vcpu*/) {}
    /// At `now` it was settled that an interrupt or a switch takes [from, until) of `core`.
    virtual void on_taken(Instant /*now*/, int /*core*/, Instant /*from*/, Instant /*until*/) {}
};

/// A running 64-bit hash: one exclusive-or, rotation and multiplication for each event. Equal runs
/// have equal hashes; it is not meant to withstand an adversary.
class TraceHash {
  public:
    constexpr void mix(std::uint64_t word) { state_ = std::rotl(state_ ^ word, 29) * 0x9E3779B97F4A7C15u; }
    constexpr void pin_written(Instant now, PinId pin, Level level) {
        mix(static_cast<std::uint64_t>(to_ns(now)) ^ (std::uint64_t{pin.number} << 49) ^
            (static_cast<std::uint64_t>(level) << 48));
    }
    constexpr void event(const TraceEvent& e) {
        mix(static_cast<std::uint64_t>(to_ns(e.time)) ^ (std::uint64_t{1} << 63) ^
            (std::uint64_t{e.vcpu} << 54) ^ (std::uint64_t{e.core} << 48) ^
            (static_cast<std::uint64_t>(e.kind) << 59));
    }
    [[nodiscard]] constexpr std::uint64_t value() const { return state_ ^ (state_ >> 32); }

  private:
    std::uint64_t state_ = 0x6A09E667F3BCC908u;
};

}  // namespace qduino::board::sim
