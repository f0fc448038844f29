#include "board/metal/pins.h"

#include "board/metal/computer/clock.h"
#include "board/metal/computer/instructions.h"
#include "board/metal/core/kernel.h"

namespace qduino::board::metal {
namespace {

Result<void> check(PinId pin) {
    if (pin.number < kPinCount) return {};
    return make_error(ErrorCode::invalid_argument, "no such pin: the board has 0…127");
}

}  // namespace

PinsWire pins_wire;

Result<void> Pins::set_mode(PinId pin, PinMode mode) {
    QDUINO_TRY(check(pin));
    if (real_) QDUINO_TRY(set_real_mode(pin, mode));
    Pin& state = pins_[pin.number];
    const bool was_output = state.output.exchange(is_output(mode));
    // What was written before shows from now on.
    if (is_output(mode) && !was_output) drive(pin, state.written.load());
    // What is wired to an input learns that it is one.
    if (!is_output(mode)) static_cast<void>(read(pin));
    return {};
}

void Pins::wire_to(Peripherals& peripherals) {
    wired_ = &peripherals;
    real_ = nullptr;
    edges_come_ = peripherals.report_edges_to(edges_);
}

void Pins::lead_to(PinPort& port) {
    wired_ = nullptr;
    real_ = &port;
    edges_come_ = port.reports_edges();
}

Result<void> Pins::set_real_mode(PinId pin, PinMode mode) {
    const InterruptsOff off;
    return real_->set_mode(pin, mode, pins_[pin.number].written.load());
}

Result<Peripherals*> Pins::wired() const {
    if (wired_) return wired_;
    if (real_)
        return make_error(ErrorCode::unsupported,
                          "this board's real pins have levels alone: no PWM, analog inputs or buses");
    return make_error(ErrorCode::unsupported,
                      "nothing is wired to this board's pins but a witness of their levels");
}

void Pins::write(PinId pin, Level level) {
    if (pin.number < kPinCount && !held_.load(std::memory_order_relaxed)) put(pin, level);
}

void Pins::put(PinId pin, Level level) {
    Pin& state = pins_[pin.number];
    state.written.store(level, std::memory_order_relaxed);
    state.pwm.store(false, std::memory_order_relaxed);
    if (state.output.load(std::memory_order_relaxed)) drive(pin, level);
}

void Pins::drive(PinId pin, Level level) {
    if (wired_) {
        wired_->pin_written(computer_clock.now(), pin, level);
    } else if (real_) {
        const InterruptsOff off;
        real_->write(pin, level);
    } else {
        write_virtual_pin(static_cast<std::uint8_t>(pin.number), level == Level::high);
    }
    if (pins_[pin.number].watched.load(std::memory_order_acquire)) note_edge(pin, level);
}

Level Pins::read(PinId pin) const {
    if (pin.number >= kPinCount) return Level::low;
    const Pin& state = pins_[pin.number];
    if (wired_ && !state.output.load(std::memory_order_relaxed))
        return wired_->pin_level(computer_clock.now(), pin);
    if (real_ && !state.output.load(std::memory_order_relaxed)) {
        const InterruptsOff off;
        return real_->read(pin);
    }
    return (state.output.load(std::memory_order_relaxed) ? state.written : state.outside)
        .load(std::memory_order_relaxed);
}

Result<void> Pins::write_pwm(PinId pin, double duty) {
    QDUINO_TRY(check(pin));
    if (!(duty >= 0 && duty <= 1)) return make_error(ErrorCode::out_of_range, "a PWM duty is within 0…1");
    QDUINO_TRY_ASSIGN(Peripherals* const peripherals, wired());
    if (held_.load(std::memory_order_relaxed)) return {};
    Pin& state = pins_[pin.number];
    state.output.store(true);  // analogWrite() needs no pinMode()
    state.pwm.store(true);
    state.written.store(duty >= 0.5 ? Level::high : Level::low);
    peripherals->pwm_written(computer_clock.now(), pin, duty);
    return {};
}

Result<void> Pins::set_pwm_period(PinId pin, Nanoseconds period) {
    QDUINO_TRY(check(pin));
    if (!is_pwm_period(period)) return bad_pwm_period();
    QDUINO_TRY_ASSIGN(Peripherals* const peripherals, wired());
    peripherals->pwm_period_set(computer_clock.now(), pin, period);
    return {};
}

Result<double> Pins::read_analog(PinId pin) const {
    QDUINO_TRY(check(pin));
    QDUINO_TRY_ASSIGN(Peripherals* const peripherals, wired());
    return peripherals->analog_level(computer_clock.now(), pin);
}

Result<void> Pins::set_safe_level(PinId pin, Level level) {
    QDUINO_TRY(check(pin));
    pins_[pin.number].safe_level = level;
    pins_[pin.number].has_safe_level = true;
    return {};
}

void Pins::force_safe_levels() {
    for (std::uint16_t number = 0; number < kPinCount; ++number) {
        Pin& state = pins_[number];
        if (!state.has_safe_level) continue;
        state.watched.store(false);  // no handler would run
        if (!state.output.exchange(true) && real_)
            static_cast<void>(set_real_mode(PinId{number}, PinMode::output));
        if (state.pwm.load())
            wired_->pwm_written(computer_clock.now(), PinId{number},
                                state.safe_level == Level::high ? 1.0 : 0.0);
        put(PinId{number}, state.safe_level);
    }
}

void Pins::hold_safe_levels() {
    held_.store(true);
    force_safe_levels();
}

// ---- edges --------------------------------------------------------------------------------------

Result<void> Pins::attach(PinId pin, Edge edge, EdgeHandler handler, void* context, VcpuId io) {
    QDUINO_TRY(check(pin));
    if (!handler) return make_error(ErrorCode::invalid_argument, "attach_edge without a handler");
    if (!edges_come_)
        return make_error(ErrorCode::unsupported,
                          real_ ? "this board's real pins report no edges"
                                : "what is wired to this board's pins reports no edges");
    if (io < kFirstIoVcpu || io >= kVcpuLimit)
        return make_error(ErrorCode::not_found, "attach_edge: no I/O VCPU of this number serves handlers");
    watches_[pin.number] = {
        .edge = edge, .handler = handler, .context = context, .io = io, .last = read(pin)};
    pins_[pin.number].watched.store(true, std::memory_order_release);
    return {};
}

void Pins::detach(PinId pin) {
    if (pin.number < kPinCount) pins_[pin.number].watched.store(false);
}

void Pins::driven(PinId pin, Level level) {
    Pin& state = pins_[pin.number];
    state.outside.store(level, std::memory_order_relaxed);
    if (state.watched.load(std::memory_order_acquire) && !state.output.load()) note_edge(pin, level);
}

void PinsWire::received(std::uint8_t byte) {
    pins.driven(PinId{static_cast<std::uint16_t>(byte & 0x7f)},
                (byte & 0x80) != 0 ? Level::high : Level::low);
}

void Pins::note_edge(PinId pin, Level level) {
    Watch& watch = watches_[pin.number];
    if (watch.last == level) return;
    watch.last = level;
    const Edge edge = level == Level::high ? Edge::rising : Edge::falling;
    if (watch.edge != Edge::both && watch.edge != edge) return;
    give_work(watch.io, {.handler = watch.handler, .context = watch.context, .came = computer_clock.now()});
}

}  // namespace qduino::board::metal
