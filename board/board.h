// THE SEAM: what a board must provide. Everything above it (runtime, arduino, sketches) calls this class, and nothing above it
// needs an operating system. tests/unit/board holds the contract suite, which every board passes.
//
//   sketch → arduino ─┬─► runtime ─┬─► board::Board ◄── board/linux   stock Linux, SCHED_FIFO threads
//                     └────────────┘                ◄── board/sim     virtual time, deterministic
//
// A board has five facets. A pure call is one that every board must have. A call with a body is a capability: a board that lacks it
// inherits the body, which answers `unsupported` or does nothing.
//
//   Timing  the clock, and waiting for it        Locks  between VCPUs, with priority inheritance
//   Pins    levels, PWM, analog, edges           Vcpus  cores, starting, stopping, what is guaranteed
//   Buses   I2C and SPI
//
// The contract, beyond the signatures:
//
//  - now() never runs backwards. It is one clock for all callers: no call returns an instant before one that was returned already.
//  - busy_until(t) and sleep_until(t) return at or after t, never before. busy_until() consumes budget, sleep_until() none.
//  - A write to a pin happens at now(). A read sees the level at now(). Pins start as inputs, low.
//  - start() has every VCPU run its entry once, on its core. run() returns at `until`; or earlier, when a stop was requested and all
//    entries have returned.
//  - These may allocate, and belong to setup: the constructor, pin_mode, pwm_period, safe_state, attach_edge, start, and the calls
//    that say so. All others are real-time safe.
//  - One VCPU holds a lock at a time (or setup() does). The holder ranks as high as the highest VCPU that waits for the lock, on
//    whichever core that one is, and through chains of locks. unlock() hands the lock to the highest of the waiting.
//  - A VCPU whose budget ends while it holds a lock goes on, for at most one budget more, and pays for it afterwards. So a waiter
//    waits for the rest of a critical section, and never for a replenishment.
//  - Three errors break a contract: to lock what one holds, to unlock what one does not hold, and to wait in a circle.
#pragma once

#include <span>

#include "base/result.h"
#include "base/time.h"
#include "board/guarantee.h"
#include "board/types.h"
#include "sched/admission.h"

namespace qduino::board {

/// Called for an edge on a pin, on an I/O VCPU.
using EdgeHandler = void (*)(void* context);

class Timing {
  public:
    [[nodiscard]] virtual Instant now() = 0;
    virtual void busy_until(Instant t) = 0;
    /// Spins for `length`, counted from the call to the return: never less. What the call itself takes is part of it.
    virtual void busy_for(Nanoseconds length) = 0;
    virtual void sleep_until(Instant t) = 0;

  protected:
    ~Timing() = default;
};

class Pins {
  public:
    /// Setup-time. Error: invalid_argument when there is no such pin.
    virtual Result<void> pin_mode(PinId pin, PinMode mode) = 0;
    virtual void pin_write(PinId pin, Level level) = 0;
    [[nodiscard]] virtual Level pin_read(PinId pin) = 0;
    /// The level that this pin is forced to when the sketch dies, hangs or is stopped. Setup-time.
    virtual Result<void> safe_state(PinId pin, Level level) = 0;

    /// `duty` is 0…1.
    virtual Result<void> pwm_write(PinId pin, double duty);
    /// The period of the pin's PWM from now on, its duty unchanged: 1 µs to 1 s; 0: the board's own again. Setup-time.
    virtual Result<void> pwm_period(PinId pin, Nanoseconds period);
    /// 0…1 of the reference.
    [[nodiscard]] virtual Result<double> analog_read(PinId pin);

    /// Routes edges of `pin` to `handler`, run as I/O VCPU `io` (which start() was or will be given). Setup-time.
    virtual Result<void> attach_edge(PinId pin, Edge edge, EdgeHandler handler, void* context, VcpuId io);
    virtual void detach_edge(PinId pin);

  protected:
    ~Pins() = default;
};

class Buses {
  public:
    /// Writes `out`, then, after a repeated start, reads `in.size()` bytes. Error: timed_out when no chip answers.
    virtual Result<void> i2c_transfer(I2cBus bus, I2cAddress address, std::span<const std::uint8_t> out,
                                      std::span<std::uint8_t> in);
    /// Full duplex, in place.
    virtual Result<void> spi_transfer(SpiBus bus, SpiSettings settings, std::span<std::uint8_t> data);

  protected:
    ~Buses() = default;
};

class Locks {
  public:
    virtual void lock(LockWord& word) = 0;
    /// False when somebody holds it, perhaps the caller.
    [[nodiscard]] virtual bool try_lock(LockWord& word) = 0;
    virtual void unlock(LockWord& word) = 0;

  protected:
    ~Locks() = default;
};

class Vcpus {
  public:
    [[nodiscard]] virtual int core_count() const = 0;
    /// The VCPU that the caller is; kNoVcpu in setup() and on threads that are none.
    [[nodiscard]] virtual VcpuId current_vcpu() const = 0;
    /// Starts the VCPUs, once. An I/O VCPU without an entry runs the handlers that are attached to it. Nothing runs after an error.
    virtual Result<void> start(std::span<const VcpuSpec> specs) = 0;
    virtual void run(Instant until) = 0;
    virtual void request_stop() = 0;
    [[nodiscard]] virtual bool stop_requested() = 0;
    [[nodiscard]] virtual GuaranteeReport guarantee() const = 0;

    /// What the platform itself takes of `core`, for admission; nothing, unless a board says otherwise. Setup-time.
    [[nodiscard]] virtual sched::PlatformOverheads platform_overheads(int core);
    /// The bottom halves of a device class become the work of I/O VCPU `io`. Setup-time.
    virtual Result<void> serve_interrupts(DeviceClass device, VcpuId io);
    /// Routes a device class's interrupts away from `core`, or lets them come there again. Setup-time.
    virtual Result<void> route_interrupts(DeviceClass device, int core, bool allowed);
    /// Stops the scheduling tick of `core`, or starts it again. Setup-time.
    virtual Result<void> core_timer(int core, bool enabled);

    // Told by the runtime, which knows of releases: for traces, and for a supervisor.
    /// The calling loop begins a release.
    virtual void note_release() {}
    /// The calling loop's release ended after its next was due.
    virtual void note_overrun() {}
    /// The calling loop's body returned without having waited for its next period, and is called again: a sign of life.
    virtual void note_body_end() { note_release(); }

  protected:
    ~Vcpus() = default;
};

class Board : public Timing, public Pins, public Buses, public Locks, public Vcpus {
  protected:
    ~Board() = default;
};

namespace detail {
extern constinit Board* current;
}
/// The board of this program. Until there is one every call is harmless: writes go nowhere, reads are low, the time is 0, and
/// a Result says `unavailable`. So a sketch's static objects may call it before main().
[[nodiscard]] inline Board& current() { return *detail::current; }
/// From now on it is `board`, which outlives its turn; null: none again. Before loops run, and after.
void make_current(Board* board);

/// What is said to a call that needs a running program.
[[nodiscard]] Error not_running();

}  // namespace qduino::board
