// THE SEAM: what a board must provide. Everything above it (runtime, arduino, sketches) is written against
// this concept; nothing above it may need an operating system. tests/unit/board holds the contract suite that
// every board passes.
//
//   sketch → arduino → runtime ──Board concept──► board/linux     stock Linux, SCHED_FIFO threads
//                                             └─► board/sim       virtual time, deterministic
//
// Contract, beyond the signatures:
//  - now() is monotonic, the same for all callers, and never earlier than any instant already handed out.
//  - busy_until(t)/sleep_until(t) return at or after t, never before. busy_until consumes CPU budget,
//  sleep_until none.
//  - A write to a pin happens at now(); a read is of the level at now(). Pins start as inputs, low.
//  - start() runs every VCPU's entry exactly once on its core; run() returns once stop was requested and all
//  entries
//    have returned, or at `until`.
//  - Only setup-time calls may allocate: construction, pin_mode, pwm_period, start, attach_edge. All others are real-time
//  safe.
//  - A lock is held by one VCPU at a time (or by setup()). Who holds it ranks as the highest of those who wait for it, on
//    whichever core, through chains of locks; unlock() hands it to the highest of them. A VCPU whose budget ends while it
//    holds a lock goes on, for one budget more at most, and pays for it afterwards: a waiter waits for the critical
//    section, not for a replenishment. Programmer's errors, that break a contract: to lock what one holds, to unlock what
//    one does not hold, and a cycle of waits.
#pragma once

#include <concepts>
#include <cstdint>
#include <span>

#include "base/result.h"
#include "base/time.h"
#include "board/guarantee.h"
#include "board/types.h"

namespace qduino::board {

/// Called for an edge on a pin, on an I/O VCPU.
using EdgeHandler = void (*)(void* context);

template <typename B>
concept Board = requires(B board, const B constant, Instant t, PinId pin, Level level, PinMode mode,
                         double duty, I2cBus i2c, I2cAddress address, SpiBus spi, SpiSettings settings,
                         std::span<const std::uint8_t> out, std::span<std::uint8_t> in,
                         std::span<const VcpuSpec> specs, Edge edge, EdgeHandler handler, void* context,
                         VcpuId io, LockWord& lock, Nanoseconds period) {
    { constant.core_count() } -> std::same_as<int>;
    { board.now() } -> std::same_as<Instant>;
    { board.busy_until(t) } -> std::same_as<void>;
    { board.busy_for(period) } -> std::same_as<void>;  // from the call to the return, never less
    { board.sleep_until(t) } -> std::same_as<void>;
    { board.current_vcpu() } -> std::same_as<VcpuId>;

    { board.pin_mode(pin, mode) } -> std::same_as<Result<void>>;
    { board.pin_write(pin, level) } -> std::same_as<void>;
    { board.pin_read(pin) } -> std::same_as<Level>;
    { board.pwm_write(pin, duty) } -> std::same_as<Result<void>>;
    /// The period of the pin's PWM from now on, its duty unchanged; 0: the board's own again. Setup-time.
    { board.pwm_period(pin, period) } -> std::same_as<Result<void>>;
    { board.analog_read(pin) } -> std::same_as<Result<double>>;  // 0…1 of the reference
    { board.i2c_transfer(i2c, address, out, in) } -> std::same_as<Result<void>>;
    { board.spi_transfer(spi, settings, in) } -> std::same_as<Result<void>>;

    /// The level this pin is forced to when the sketch dies, hangs or is stopped.
    { board.safe_state(pin, level) } -> std::same_as<Result<void>>;
    /// Routes edges of `pin` to `handler`, run as I/O VCPU `io` (which start() was or will be given).
    { board.attach_edge(pin, edge, handler, context, io) } -> std::same_as<Result<void>>;
    { board.detach_edge(pin) } -> std::same_as<void>;

    { board.lock(lock) } -> std::same_as<void>;
    { board.try_lock(lock) } -> std::same_as<bool>;  // false: somebody holds it, the caller perhaps
    { board.unlock(lock) } -> std::same_as<void>;

    { board.start(specs) } -> std::same_as<Result<void>>;
    { board.run(t) } -> std::same_as<void>;
    { board.request_stop() } -> std::same_as<void>;
    { board.stop_requested() } -> std::same_as<bool>;
    { board.guarantee() } -> std::same_as<GuaranteeReport>;
};

}  // namespace qduino::board
