// THE SEAM: what a board must provide. The runtime, the Arduino face and the sketches above it call
// this class, and none of them needs an operating system.
//
//   sketch → arduino ─┬─► runtime ─┬─► board::Board ◄─ board/linux  stock Linux, SCHED_FIFO threads
//                     └────────────┘                ◄─ board/sim    virtual time, deterministic
//
// A pure call is one that every board must have. A call with a body is a capability: a board that
// lacks it inherits the body, which answers `unsupported` or does nothing. It has more functions
// than other classes, for it is the whole list: a caller needs no second type, and a call no
// adjustment.
//
// The contract, beyond the signatures. The suite in tests/unit/board holds every board to it.
//
// Time
// - now() never goes back, and every caller sees the same clock.
// - busy_until(t) and sleep_until(t) return at `t` or later, never before. busy_until() spends the
//   caller's CPU budget, sleep_until() spends none.
//
// Pins
// - A write happens at now(). A read gives the level at now(). A pin starts as an input, low.
//
// Running
// - start() runs the entry of every VCPU exactly once, on its core.
// - run(until) returns when a stop was requested and all entries have returned, or at `until`.
// - Only construction, start(), and the calls marked "Setup-time" may allocate. Every other call is
//   real-time safe.
//
// Locks
// - One VCPU holds a lock at a time, or setup() does.
// - The holder gets the rank of the highest VCPU that waits for it, on any core and through chains
//   of locks. Nothing of lower rank than the waiter can then delay the holder.
// - unlock() hands the lock to the highest waiter.
// - A holder whose budget ends runs on, for at most one budget more, and pays for it afterwards. So
//   a waiter waits for a critical section and not for a replenishment.
// - It breaks a contract to lock what one holds, to unlock what one does not hold, or to wait in a
//   cycle.
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

class Board {
  public:
    // ---- time -----------------------------------------------------------------------------------
    [[nodiscard]] virtual Instant now() = 0;
    virtual void busy_until(Instant t) = 0;
    /// Spins for `length`, counted from the call to the return: never less. The cost of the call
    /// itself is part of it.
    virtual void busy_for(Nanoseconds length) = 0;
    virtual void sleep_until(Instant t) = 0;

    // ---- pins -----------------------------------------------------------------------------------
    /// Setup-time. Error: invalid_argument when there is no such pin.
    virtual Result<void> pin_mode(PinId pin, PinMode mode) = 0;
    virtual void pin_write(PinId pin, Level level) = 0;
    /// All of them to `level`: at one instant where the board can, else one after the other.
    virtual void pins_write(std::span<const PinId> pins, Level level);
    [[nodiscard]] virtual Level pin_read(PinId pin) = 0;
    /// The level that this pin is forced to when the sketch dies, hangs or is stopped. Setup-time.
    virtual Result<void> safe_state(PinId pin, Level level) = 0;

    /// `duty` is 0…1.
    virtual Result<void> pwm_write(PinId pin, double duty);
    /// The period of the pin's PWM from now on, its duty unchanged: 1 µs to 1 s; 0: the board's own
    /// again. Setup-time.
    virtual Result<void> pwm_period(PinId pin, Nanoseconds period);
    /// 0…1 of the reference.
    [[nodiscard]] virtual Result<double> analog_read(PinId pin);

    /// The temperature of the processor, in °C. Not real-time.
    [[nodiscard]] virtual Result<double> chip_temperature();

    /// Routes edges of `pin` to `handler`, run as I/O VCPU `io` (which start() was or will be
    /// given). Setup-time, and, while the VCPUs run, for a pin that had this handler before: to
    /// detach_edge() it and attach it again must not allocate.
    virtual Result<void> attach_edge(PinId pin, Edge edge, EdgeHandler handler, void* context, VcpuId io);
    virtual void detach_edge(PinId pin);
    /// When the edge came that the calling handler runs for; kForever: nobody knows.
    [[nodiscard]] virtual Instant handler_came() const { return kForever; }

    // ---- buses ----------------------------------------------------------------------------------
    /// Writes `out`, then, after a repeated start, reads `in.size()` bytes. Error: timed_out when
    /// no chip answers.
    virtual Result<void> i2c_transfer(I2cBus bus, I2cAddress address, std::span<const std::uint8_t> out,
                                      std::span<std::uint8_t> in);
    /// Full duplex, in place.
    virtual Result<void> spi_transfer(SpiBus bus, SpiSettings settings, std::span<std::uint8_t> data);

    /// The calling VCPU moves `bytes` through a device that the board does not carry itself: a
    /// serial port, a network card. 0: it asked there, in vain. Takes what that costs where devices
    /// are simulated; nothing elsewhere.
    virtual void device_work([[maybe_unused]] DeviceClass device, [[maybe_unused]] std::size_t bytes) {}
    /// A byte of a serial port takes its time at the baud rate, and whoever carries the bytes is to
    /// say so by busy_until(). False where the port is real: there the hardware does.
    [[nodiscard]] virtual bool serial_takes_time() const { return false; }

    /// How long so many bytes keep a bus, or a serial port, at `clock_hz` (0: nobody said): for who
    /// waits for it. Here the bus' own bits; what a serial port takes is its buffer's. Setup-time.
    [[nodiscard]] virtual Nanoseconds bus_time(DeviceClass device, std::size_t bytes,
                                               std::uint32_t clock_hz) const;
    /// What each edge of a pin with a handler takes, above every loop, beside what
    /// platform_overheads() counts.
    [[nodiscard]] virtual EdgeCost edge_cost() const { return {}; }

    // ---- locks ----------------------------------------------------------------------------------
    virtual void lock(LockWord& word) = 0;
    /// False when somebody holds it, perhaps the caller.
    [[nodiscard]] virtual bool try_lock(LockWord& word) = 0;
    virtual void unlock(LockWord& word) = 0;

    // ---- VCPUs ----------------------------------------------------------------------------------
    [[nodiscard]] virtual int core_count() const = 0;
    /// The VCPU of the caller; kNoVcpu in setup() and on threads that are none.
    [[nodiscard]] virtual VcpuId current_vcpu() const = 0;
    /// How long the calling VCPU has slept so far, in sleep_until(): for what a release sleeps.
    [[nodiscard]] virtual Nanoseconds slept() const { return Nanoseconds{0}; }
    /// In how many sleeps.
    [[nodiscard]] virtual std::int64_t sleeps() const { return 0; }
    /// Starts the VCPUs, once. An I/O VCPU without an entry runs the handlers that are attached to
    /// it. Nothing runs after an error.
    virtual Result<void> start(std::span<const VcpuSpec> specs) = 0;
    virtual void run(Instant until) = 0;
    virtual void request_stop() = 0;
    [[nodiscard]] virtual bool stop_requested() = 0;
    [[nodiscard]] virtual GuaranteeReport guarantee() const = 0;

    /// The platform's own overheads on `core`, for admission; nothing, unless a board says
    /// otherwise. Setup-time.
    [[nodiscard]] virtual sched::PlatformOverheads platform_overheads(int core);
    /// The bottom halves of a device class become the work of I/O VCPU `io`. Setup-time.
    virtual Result<void> serve_interrupts(DeviceClass device, VcpuId io);
    /// I/O VCPU `io` has another budget and period, from its next activation on at the latest; its
    /// core and its rank stay. By one caller at a time. Error: not_found.
    virtual Result<void> change_io(VcpuId io, sched::VcpuParameters parameters);
    /// Routes a device class's interrupts away from `core`, or lets them come there again.
    /// Setup-time.
    virtual Result<void> route_interrupts(DeviceClass device, int core, bool allowed);
    /// Stops the scheduling tick of `core`, or starts it again. Setup-time.
    virtual Result<void> core_timer(int core, bool enabled);

    // For a profile (runtime/profile.h); zero where the board cannot tell.
    /// CPU time that the calling VCPU has consumed.
    [[nodiscard]] virtual Nanoseconds cpu_time() { return {}; }
    [[nodiscard]] virtual Incidents incidents() { return {}; }

    // Told by the runtime, which knows of releases: for traces, and for a supervisor.
    /// The calling loop begins the release that was due at `nominal`.
    virtual void note_release(Instant nominal) { static_cast<void>(nominal); }
    /// The calling loop's release ended `lateness` after its next was due.
    virtual void note_overrun([[maybe_unused]] Nanoseconds lateness) {}
    /// The calling loop's body returned without having waited for its next period, and is called
    /// again.
    virtual void note_body_end() {}
    /// setup() begins, or has ended. A supervisor bounds how long it may last.
    virtual void note_setup([[maybe_unused]] bool running) {}
    /// The caller (a loop, a handler, setup()) makes progress: more than the sign of life that each
    /// wait is.
    virtual void note_progress() {}
    /// Loop `id` hangs when for `limit` it has neither begun a release nor made progress, however
    /// often it is heard of; 0: it may wait as long as it likes. Setup-time, or by the loop itself.
    virtual void promise_progress([[maybe_unused]] VcpuId id, [[maybe_unused]] Nanoseconds limit) {}

  protected:
    // Never deleted through this class: a board without a heap needs no `operator delete`.
    ~Board() = default;
};

namespace detail {
extern constinit Board* current;
}
/// The board of this program. Until there is one every call is harmless: the time is 0, pins are
/// remembered (early_pins.h), and any other Result says `unavailable`. So a sketch's static objects
/// may call it before main().
[[nodiscard]] inline Board& current() { return *detail::current; }
/// Makes `board` the current one; it must outlive its turn. null: none again. Before loops run, and
/// after.
void make_current(Board* board);

using PinRefused = void (*)(PinId pin, const Error& error);
/// Does on the current board what pins were asked while there was none. Before setup(), once.
void hand_over_early_pins(PinRefused refused);

/// The error of a call that needs a running program.
[[nodiscard]] Error not_running();

}  // namespace qduino::board
