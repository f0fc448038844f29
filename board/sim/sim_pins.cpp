#include "board/sim/sim_pins.h"

#include <algorithm>
#include <utility>

#include "base/contract.h"

namespace qduino::board::sim {

namespace {

bool active(Instant now, Instant from, Instant until) { return from <= now && now < until; }

Result<void> check(PinId pin) {
    if (pin.number < kPinCount) return {};
    return make_error(ErrorCode::invalid_argument, "no such pin: the board has 0…127");
}

}  // namespace

SimPins::SimPins(SimConfig config, Peripherals& peripherals, EventLoop& loop)
    : config_(std::move(config)),
      loop_(loop),
      peripherals_(peripherals),
      edges_are_reported_(peripherals.report_edges_to(*this)) {
    QDUINO_EXPECT(config_.edge_poll_period > Nanoseconds{0});
}

void SimPins::process_due(Instant now) {
    if (peripherals_.next_event(now) <= now) {
        peripherals_.advance(now);
        QDUINO_EXPECT(peripherals_.next_event(now) > now);
    }
    if (next_held_back_ <= now) take_held_back(now);
    if (next_poll_ > now) return;
    poll_watched_pins();
    next_poll_ = now + config_.edge_poll_period;
}

// ---- pins and buses -----------------------------------------------------------------------------

Result<void> SimPins::pin_mode(PinId pin, PinMode mode) {
    loop_.charge(ApiCall::pin_mode);
    QDUINO_TRY(check(pin));
    PinState& state = pins_[pin.number];
    const bool was_output = std::exchange(state.output, is_output(mode));
    if (state.output && !was_output)
        pin_write(pin, state.level);  // what was written before shows from now on
    if (was_output && !state.output) peripherals_.pin_released(loop_.now(), pin);
    peripherals_.pin_pulled_up(loop_.now(), pin, mode == PinMode::input_pullup);
    return {};
}

Level SimPins::pin_read(PinId pin) {
    loop_.before_poll(ApiCall::pin_read);
    if (pin.number >= kPinCount) return Level::low;
    const PinState& state = pins_[pin.number];
    Level level = state.level;
    if (stuck(pin, &level) || state.output) return level;
    return peripherals_.pin_level(loop_.now(), pin);
}

Result<void> SimPins::pwm_write(PinId pin, double duty) {
    loop_.charge(ApiCall::pwm_write);
    QDUINO_TRY(check(pin));
    if (!(duty >= 0.0 && duty <= 1.0))
        return make_error(ErrorCode::invalid_argument, "a PWM duty is within 0…1");
    pins_[pin.number].pwm = true;
    loop_.hash().mix(static_cast<std::uint64_t>(to_ns(loop_.now())) ^ (std::uint64_t{pin.number} << 49));
    loop_.hash().mix(static_cast<std::uint64_t>(duty * 4294967295.0));
    peripherals_.pwm_written(loop_.now(), pin, duty);
    return {};
}

Result<void> SimPins::pwm_period(PinId pin, Nanoseconds period) {
    loop_.charge(ApiCall::pwm_write);
    QDUINO_TRY(check(pin));
    if (!is_pwm_period(period)) return bad_pwm_period();
    loop_.hash().mix(static_cast<std::uint64_t>(to_ns(loop_.now())) ^ (std::uint64_t{pin.number} << 49));
    loop_.hash().mix(static_cast<std::uint64_t>(to_ns(period)));
    peripherals_.pwm_period_set(loop_.now(), pin, period);
    return {};
}

Result<double> SimPins::analog_read(PinId pin) {
    loop_.before_poll(ApiCall::analog_read);
    QDUINO_TRY(check(pin));
    Level level = Level::low;
    if (stuck(pin, &level)) return level == Level::high ? 1.0 : 0.0;
    return std::clamp(peripherals_.analog_level(loop_.now(), pin), 0.0, 1.0);
}

Result<void> SimPins::i2c_transfer(I2cBus bus, I2cAddress address, std::span<const std::uint8_t> out,
                                   std::span<std::uint8_t> in) {
    loop_.charge(ApiCall::i2c);
    const auto bytes = static_cast<std::int64_t>(out.size() + in.size() + 1);  // and the address
    loop_.work_of_device(DeviceClass::i2c, config_.costs.i2c_per_byte * bytes);
    for (const SilentChip& chip : config_.silent_chips) {
        if (chip.bus.number == bus.number && chip.address.value == address.value &&
            active(loop_.now(), chip.from, chip.until)) {
            return make_error(ErrorCode::timed_out, "no chip answers at this I2C address (injected fault)");
        }
    }
    return peripherals_.i2c_transfer(loop_.now(), bus, address, out, in);
}

Result<void> SimPins::spi_transfer(SpiBus bus, SpiSettings settings, std::span<std::uint8_t> data) {
    loop_.charge(ApiCall::spi);
    loop_.work_of_device(DeviceClass::spi,
                         config_.costs.spi_per_byte * static_cast<std::int64_t>(data.size()));
    return peripherals_.spi_transfer(loop_.now(), bus, settings, data);
}

Nanoseconds SimPins::bus_time(DeviceClass device, std::size_t bytes, std::uint32_t) const {
    const board::sim::ApiCosts& costs = config_.costs;
    const auto count = static_cast<std::int64_t>(bytes);
    if (device == DeviceClass::i2c) return costs[ApiCall::i2c] + count * costs.i2c_per_byte;
    if (device == DeviceClass::spi) return costs[ApiCall::spi] + count * costs.spi_per_byte;
    return device == DeviceClass::uart ? count * costs.uart_per_byte : Nanoseconds{0};
}

void SimPins::device_work(DeviceClass device, std::size_t bytes) {
    if (bytes == 0) return loop_.ask_host();
    if (device == DeviceClass::uart) count_call();
    Nanoseconds per_byte{};
    if (device == DeviceClass::uart) per_byte = config_.costs.uart_per_byte;
    if (device == DeviceClass::nic) per_byte = config_.costs.nic_per_byte;
    loop_.work_of_device(device, per_byte * static_cast<std::int64_t>(bytes));
}

Result<void> SimPins::safe_state(PinId pin, Level level) {
    QDUINO_TRY(check(pin));
    pins_[pin.number].has_safe_state = true;
    pins_[pin.number].safe_level = level;
    return {};
}

void SimPins::force_safe_states() {
    for (std::uint16_t number = 0; number < kPinCount; ++number) {
        PinState& state = pins_[number];
        if (!state.has_safe_state) continue;
        const PinId pin{number};
        state.output = true;
        state.level = state.safe_level;
        loop_.hash().pin_written(loop_.now(), pin, state.safe_level);
        if (state.pwm)
            peripherals_.pwm_written(loop_.now(), pin, state.safe_level == Level::high ? 1.0 : 0.0);
        peripherals_.pin_written(loop_.now(), pin, state.safe_level);
    }
}

bool SimPins::stuck(PinId pin, Level* level) const {
    for (const StuckPin& fault : config_.stuck_pins) {
        if (fault.pin != pin || !active(loop_.now(), fault.from, fault.until)) continue;
        *level = fault.level;
        return true;
    }
    return false;
}

// ---- edges --------------------------------------------------------------------------------------

Result<void> SimPins::attach_edge(PinId pin, Edge edge, EdgeHandler handler, void* context, VcpuId io) {
    QDUINO_TRY(check(pin));
    if (handler == nullptr) return make_error(ErrorCode::invalid_argument, "attach_edge without a handler");
    const Vcpu* const server = loop_.cpus().vcpu(io);
    const bool known = io >= kFirstIoVcpu && io < kVcpuLimit && (!loop_.started() || server);
    if (!known || (loop_.started() && !server->queue)) {
        return make_error(ErrorCode::not_found, "attach_edge: no I/O VCPU of this number serves handlers");
    }
    PinState& state = pins_[pin.number];
    const Level level = state.output ? state.level : peripherals_.pin_level(loop_.now(), pin);
    watches_[pin.number] = {.edge = edge, .handler = handler, .context = context, .io = io, .last = level};
    state.watched = true;
    if (!edges_are_reported_ && next_poll_ == kForever) {
        next_poll_ = loop_.now() + config_.edge_poll_period;
        if (loop_.started()) loop_.look_up_at(next_poll_);
    }
    return {};
}

void SimPins::detach_edge(PinId pin) {
    if (pin.number >= kPinCount) return;
    pins_[pin.number].watched = false;
    watches_[pin.number] = {};
}

void SimPins::pin_edge(Instant now, PinId pin, Level level) {
    if (pin.number >= kPinCount || !pins_[pin.number].watched) return;
    EdgeWatch& watch = watches_[pin.number];
    Level forced = level;
    if (stuck(pin, &forced)) return;
    if (level == watch.last) return;
    watch.last = level;
    const Edge edge = level == Level::high ? Edge::rising : Edge::falling;
    if (watch.edge != Edge::both && watch.edge != edge) return;
    static_cast<void>(now);  // the instant of the call being served: that of the loop
    if (loop_.now() >= watch.next_top_half) return take_edge(watch);
    if (std::exchange(watch.held_back, true)) loop_.note_lost_edge();
    next_held_back_ = std::min(next_held_back_, watch.next_top_half);
    loop_.look_up_at(watch.next_top_half);
}

/// Those that were held back long enough.
void SimPins::take_held_back(Instant now) {
    next_held_back_ = kForever;
    for (std::uint16_t number = 0; number < kPinCount; ++number) {
        EdgeWatch& watch = watches_[number];
        if (!watch.held_back || !pins_[number].watched) continue;
        if (watch.next_top_half > now)
            next_held_back_ = std::min(next_held_back_, watch.next_top_half);
        else
            take_edge(watch);
    }
}

void SimPins::take_edge(EdgeWatch& watch) {
    watch.held_back = false;
    if (config_.edge_top_half > Nanoseconds{0}) watch.next_top_half = loop_.now() + config_.edge_interval;
    loop_.give_work(watch.io, {.handler = watch.handler, .context = watch.context});
    const Vcpu* const server = loop_.cpus().vcpu(watch.io);
    if (!server) return;
    server->core->tally().edges.add(config_.edge_top_half);
    if (config_.edge_top_half > Nanoseconds{0}) {
        server->core->interrupt(loop_.now(), config_.edge_top_half);
        loop_.look_up();
    }
}

void SimPins::poll_watched_pins() {
    for (std::uint16_t number = 0; number < kPinCount; ++number) {
        const PinState& state = pins_[number];
        if (state.watched && !state.output)
            pin_edge(loop_.now(), PinId{number}, peripherals_.pin_level(loop_.now(), PinId{number}));
    }
}

}  // namespace qduino::board::sim
