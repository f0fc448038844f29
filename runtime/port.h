// The port: what the Arduino face calls, decided when a program is linked.
//
//   arduino/*.cpp ──► port:: (these functions) ──► Runtime<Board> ──► the board that the app chose
//
// An app gives them a body by writing QDUINO_BIND_BOARD(SomeBoard) once (runtime/bind.h). There is no table
// of function pointers and no #if: a simulated and a real program differ in that one line of their
// composition root.
//
// Unless said otherwise a function may be called from any loop and from setup(), allocates nothing and locks
// nothing.
#pragma once

#include <cstdint>
#include <span>

#include "base/result.h"
#include "base/time.h"
#include "board/types.h"

namespace qduino::port {

using board::Edge;
using board::I2cAddress;
using board::I2cBus;
using board::Level;
using board::PinId;
using board::PinMode;
using board::SpiBus;
using board::SpiSettings;
using board::VcpuId;

// ---- time -------------------------------------------------------------------------------------------------
[[nodiscard]] Instant now();
void busy_until(Instant t);         ///< spins, consuming budget; never returns early
void busy_for(Nanoseconds length);  ///< the same, counted from the call to the return
void sleep_until(Instant t);        ///< blocks, consuming none; never returns early

// ---- pins and buses ---------------------------------------------------------------------------------------
Result<void> pin_mode(PinId pin, PinMode mode);  ///< setup-time
void pin_write(PinId pin, Level level);
[[nodiscard]] Level pin_read(PinId pin);
Result<void> pwm_write(PinId pin, double duty);          ///< duty 0…1
Result<void> pwm_period(PinId pin, Nanoseconds period);  ///< 1 µs to 1 s; 0: the board's own. Setup-time
[[nodiscard]] Result<double> analog_read(PinId pin);     ///< 0…1 of the reference
Result<void> i2c_transfer(I2cBus bus, I2cAddress address, std::span<const std::uint8_t> out,
                          std::span<std::uint8_t> in);
Result<void> spi_transfer(SpiBus bus, SpiSettings settings, std::span<std::uint8_t> data);
Result<void> safe_state(PinId pin, Level level);  ///< setup-time

// ---- loops ------------------------------------------------------------------------------------------------
[[nodiscard]] VcpuId current_vcpu();  ///< 0 in setup()
/// Ends this release of the calling loop; returns at the start of its next one (never early). See
/// runtime/loop.h.
void wait_for_next_period();
void yield();
/// Sets the overrun policy of a loop. Setup-time, or from the loop itself.
void set_overrun_policy(VcpuId loop, std::uint8_t policy, void (*callback)(VcpuId, Nanoseconds));

// ---- locks: see board/board.h; not recursive --------------------------------------------------------------
void lock(board::LockWord& word);  ///< waits, consuming no budget, while another VCPU holds it
[[nodiscard]] bool try_lock(board::LockWord& word);
void unlock(board::LockWord& word);

// ---- interrupts -------------------------------------------------------------------------------------------
/// Budget and period of the I/O VCPU that serves device class `device` (runtime/sketch.h: DeviceClass).
/// Setup-time.
Result<void> interrupts_vcpu(std::uint8_t device, Nanoseconds budget, Nanoseconds period, int core);
/// `handler` runs on the I/O VCPU given by budget/period/core; a zero budget means the default I/O VCPU.
/// Setup-time.
Result<void> attach_interrupt(PinId pin, Edge edge, void (*handler)(), Nanoseconds budget, Nanoseconds period,
                              int core);
void detach_interrupt(PinId pin);
Result<void> route_interrupts(std::uint8_t device, int core, bool allowed);
Result<void> core_timer(int core, bool enabled);
void global_interrupts(
    bool enabled);  ///< Arduino's noInterrupts()/interrupts(): holds handlers back, nothing else

// ---- the program ------------------------------------------------------------------------------------------
void request_stop();
[[nodiscard]] bool stop_requested();

}  // namespace qduino::port
