// Binding: gives the functions of port.h their bodies, for one board, in one line of a program's composition root.
//
//   QDUINO_BIND_BOARD(qduino::board::sim::SimBoard);        // once per program, at global scope
//   …
//   qduino::port::bind(&runtime);                           // before begin(); null when the runtime goes
//
// Until a runtime is bound (a static initialiser that calls digitalWrite, say) every call is harmless: writes go
// nowhere, reads are low, the time is 0, what returns a Result says `unavailable`.
#pragma once

#include "runtime/port.h"
#include "runtime/runtime.h"

namespace qduino::port {

[[nodiscard]] inline Error not_running() {
    return make_error(ErrorCode::unavailable,
                      "the board is not running yet: call this from setup() or a loop");
}

}  // namespace qduino::port

/// The functions of port.h, forwarded to a runtime::Runtime<BoardType>.
#define QDUINO_BIND_BOARD(BoardType)                                                                         \
    namespace qduino::port {                                                                                 \
    namespace {                                                                                              \
    runtime::Runtime<BoardType>* bound = nullptr;                                                            \
    BoardType* wired = nullptr;                                                                              \
    }                                                                                                        \
    void bind(runtime::Runtime<BoardType>* to) {                                                             \
        bound = to;                                                                                          \
        wired = to ? &to->board() : nullptr;                                                                 \
    }                                                                                                        \
    Instant now() { return wired ? wired->now() : kEpoch; }                                                  \
    void busy_until(Instant t) {                                                                             \
        if (wired) wired->busy_until(t);                                                                     \
    }                                                                                                        \
    void busy_for(Nanoseconds length) {                                                                      \
        if (wired) wired->busy_for(length);                                                                  \
    }                                                                                                        \
    void sleep_until(Instant t) {                                                                            \
        if (wired) wired->sleep_until(t);                                                                    \
    }                                                                                                        \
    Result<void> pin_mode(PinId pin, PinMode mode) {                                                         \
        return wired ? wired->pin_mode(pin, mode) : not_running();                                           \
    }                                                                                                        \
    void pin_write(PinId pin, Level level) {                                                                 \
        if (wired) wired->pin_write(pin, level);                                                             \
    }                                                                                                        \
    Level pin_read(PinId pin) { return wired ? wired->pin_read(pin) : Level::low; }                          \
    Result<void> pwm_write(PinId pin, double duty) {                                                         \
        return wired ? wired->pwm_write(pin, duty) : not_running();                                          \
    }                                                                                                        \
    Result<void> pwm_period(PinId pin, Nanoseconds period) {                                                 \
        return wired ? wired->pwm_period(pin, period) : not_running();                                       \
    }                                                                                                        \
    Result<double> analog_read(PinId pin) {                                                                  \
        return wired ? wired->analog_read(pin) : Result<double>(not_running());                              \
    }                                                                                                        \
    Result<void> i2c_transfer(I2cBus bus, I2cAddress address, std::span<const std::uint8_t> out,             \
                              std::span<std::uint8_t> in) {                                                  \
        return wired ? wired->i2c_transfer(bus, address, out, in) : not_running();                           \
    }                                                                                                        \
    Result<void> spi_transfer(SpiBus bus, SpiSettings settings, std::span<std::uint8_t> data) {              \
        return wired ? wired->spi_transfer(bus, settings, data) : not_running();                             \
    }                                                                                                        \
    Result<void> safe_state(PinId pin, Level level) {                                                        \
        return wired ? wired->safe_state(pin, level) : not_running();                                        \
    }                                                                                                        \
    void lock(board::LockWord& word) {                                                                       \
        if (wired) wired->lock(word);                                                                        \
    }                                                                                                        \
    bool try_lock(board::LockWord& word) { return !wired || wired->try_lock(word); }                         \
    void unlock(board::LockWord& word) {                                                                     \
        if (wired) wired->unlock(word);                                                                      \
    }                                                                                                        \
    VcpuId current_vcpu() { return wired ? wired->current_vcpu() : board::kNoVcpu; }                         \
    void wait_for_next_period() {                                                                            \
        if (bound) bound->wait_for_next_period();                                                            \
    }                                                                                                        \
    void yield() {                                                                                           \
        if (bound) bound->yield();                                                                           \
    }                                                                                                        \
    void set_overrun_policy(VcpuId loop, std::uint8_t policy, void (*callback)(VcpuId, Nanoseconds)) {       \
        if (bound) bound->set_overrun_policy(loop, static_cast<runtime::OverrunPolicy>(policy), callback);   \
    }                                                                                                        \
    Result<void> interrupts_vcpu(std::uint8_t device, Nanoseconds budget, Nanoseconds period, int core) {    \
        return bound ? bound->interrupts_vcpu(static_cast<board::DeviceClass>(device), budget, period, core) \
                     : not_running();                                                                        \
    }                                                                                                        \
    Result<void> attach_interrupt(PinId pin, Edge edge, void (*handler)(), Nanoseconds budget,               \
                                  Nanoseconds period, int core) {                                            \
        return bound ? bound->attach_interrupt(pin, edge, handler, budget, period, core) : not_running();    \
    }                                                                                                        \
    void detach_interrupt(PinId pin) {                                                                       \
        if (bound) bound->detach_interrupt(pin);                                                             \
    }                                                                                                        \
    Result<void> route_interrupts(std::uint8_t device, int core, bool allowed) {                             \
        return bound ? bound->route_interrupts(static_cast<board::DeviceClass>(device), core, allowed)       \
                     : not_running();                                                                        \
    }                                                                                                        \
    Result<void> core_timer(int core, bool enabled) {                                                        \
        return bound ? bound->core_timer(core, enabled) : not_running();                                     \
    }                                                                                                        \
    void global_interrupts(bool enabled) {                                                                   \
        if (bound) bound->global_interrupts(enabled);                                                        \
    }                                                                                                        \
    void request_stop() {                                                                                    \
        if (wired) wired->request_stop();                                                                    \
    }                                                                                                        \
    bool stop_requested() { return wired && wired->stop_requested(); }                                       \
    }                                                                                                        \
    static_assert(true)
