#include "twin/printer.h"

#include <algorithm>

#include "base/contract.h"

namespace qduino::twin {

using board::Level;
using board::PinId;

Printer::Printer(const Machine& machine)
    : machine_(machine),
      axes_{{{machine.axes[0], true},
             {machine.axes[1], true},
             {machine.axes[2], true},
             {machine.axes[3], false}}},
      heaters_{
          {{machine.heaters[0], machine.ambient_celsius}, {machine.heaters[1], machine.ambient_celsius}}},
      converter_(machine.adc_reference_v),
      volume_per_step_mm3_(machine.step_volume_mm3()) {
    for (int axis = 0; axis < kAxisCount; ++axis) {
        const AxisSpec& spec = machine.axes[axis];
        wire(spec.step_pin, Role::step, axis);
        wire(spec.direction_pin, Role::direction, axis);
        wire(spec.enable_pin, Role::enable, axis);
        if (axis < kSlideCount) wire(spec.endstop_pin, Role::endstop, axis);
    }
    for (int heater = 0; heater < kHeaterCount; ++heater)
        wire(machine.heaters[heater].heater_pin, Role::heater, heater);
    wire(machine.fan_pin, Role::fan, 0);
}

void Printer::wire(std::uint16_t pin, Role role, int index) {
    if (pin == kNotWired) return;
    QDUINO_EXPECT(pin < board::kPinCount);
    // Drivers may share an enable line.
    QDUINO_EXPECT(wires_[pin].role == Role::none || role == Role::enable);
    wires_[pin] = {role, static_cast<std::uint8_t>(index)};
}

void Printer::pin_written(Instant now, PinId pin, Level level) {
    if (pin.number >= board::kPinCount) return;
    if (now >= next_fault_) [[unlikely]]
        apply_due_faults(now);
    driven_[pin.number] = level;
    const Wire wire = wires_[pin.number];
    const bool high = level == Level::high;
    switch (wire.role) {
        case Role::step:
            return step_pin(now, wire.index, high);
        case Role::direction:
            return axes_[wire.index].write_direction(now, high);
        case Role::enable:
            for (std::size_t axis = 0; axis < kAxisCount; ++axis)
                if (machine_.axes[axis].enable_pin == pin.number) axes_[axis].write_enable(high);
            return;
        case Role::heater:
        case Role::fan:
            return drive(now, wire, high ? 1.0 : 0.0);
        case Role::endstop:
        case Role::none:
            return;
    }
}

void Printer::step_pin(Instant now, std::size_t axis, bool level) {
    AxisDrive& drive = axes_[axis];
    const int direction = drive.write_step(now, level);
    if (direction == 0) return;
    if (axis == kExtruder && direction > 0) {
        heaters_[kHotEnd].advance(now);
        heaters_[kHotEnd].melt(volume_per_step_mm3_);
    }
    if (observer_)
        observer_->on_step(
            {now, static_cast<std::uint8_t>(axis), static_cast<std::int8_t>(direction), drive.position()});
    if (drive.update_switch(now) && observer_)
        observer_->on_endstop(now, static_cast<int>(axis), drive.pressed());
}

void Printer::drive(Instant now, Wire wire, double duty) {
    if (wire.role == Role::heater) {
        heaters_[wire.index].set_duty(now, duty);
    } else if (wire.role == Role::fan) {
        fan_duty_ = duty;
        for (Heater& heater : heaters_) heater.set_fan(now, duty);
    }
}

void Printer::pwm_written(Instant now, PinId pin, double duty) {
    if (pin.number >= board::kPinCount) return;
    if (now >= next_fault_) apply_due_faults(now);
    drive(now, wires_[pin.number], std::clamp(duty, 0.0, 1.0));
}

// A bouncing contact alternates every 100 µs until it has settled, ending on its new level.
bool Printer::contact(Instant now, std::size_t axis) const {
    const AxisDrive& drive = axes_[axis];
    const Nanoseconds since = now - drive.switched_at();
    const Nanoseconds bounce = machine_.axes[axis].bounce;
    if (since < bounce && (since / Nanoseconds{100'000}) % 2 != 0) return !drive.pressed();
    return drive.pressed();
}

Level Printer::pin_level(Instant now, PinId pin) {
    if (pin.number >= board::kPinCount) return Level::low;
    if (now >= next_fault_) apply_due_faults(now);
    const Wire wire = wires_[pin.number];
    if (wire.role != Role::endstop) return driven_[pin.number];
    const auto& fault = switches_[wire.index];
    const bool closed = fault ? *fault == FaultKind::endstop_stuck_closed : contact(now, wire.index);
    return closed ? Level::high : Level::low;
}

double Printer::sensor_celsius(Instant now, int heater) {
    if (now >= next_fault_) apply_due_faults(now);
    Heater& block = heaters_[heater];
    block.advance(now);
    return block.sensor_celsius();
}

double Printer::sensor_volts(Instant now, int channel) {
    for (std::size_t heater = 0; heater < kHeaterCount; ++heater) {
        const HeaterSpec& spec = machine_.heaters[heater];
        if (spec.adc_channel != channel) continue;
        const Sensor& sensor = sensors_[heater];
        if (sensor.fault == FaultKind::sensor_open) return machine_.adc_reference_v;
        if (sensor.fault == FaultKind::sensor_short) return 0.0;
        const double celsius = sensor.fault == FaultKind::sensor_stuck
                                   ? sensor.stuck_celsius
                                   : sensor_celsius(now, static_cast<int>(heater));
        return machine_.adc_reference_v * spec.thermistor.fraction(Celsius{celsius});
    }
    return 0.0;
}

Result<void> Printer::i2c_transfer(Instant now, board::I2cBus bus, board::I2cAddress address,
                                   std::span<const std::uint8_t> out, std::span<std::uint8_t> in) {
    if (now >= next_fault_) apply_due_faults(now);
    const bool wired = machine_.i2c_bus < 0 || machine_.i2c_bus == bus.number;
    if (!wired || address.value != machine_.adc_address || bus_silent_)
        return make_error(ErrorCode::timed_out,
                          "no chip answers at this I2C address: check wiring and address");
    converter_.transfer(out, in, [&](int channel) { return sensor_volts(now, channel); });
    if (!in.empty()) ++conversions_;
    return {};
}

Result<void> Printer::spi_transfer(Instant, board::SpiBus, board::SpiSettings, std::span<std::uint8_t> data) {
    std::ranges::fill(data, std::uint8_t{0xFF});  // nothing drives MISO; the line is pulled up
    return {};
}

PrinterState Printer::state(Instant now) {
    PrinterState state;
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
        state.position_steps[axis] = axes_[axis].position();
        state.position_mm[axis] =
            static_cast<double>(axes_[axis].position()) / machine_.axes[axis].steps_per_mm;
        state.counters[axis] = axes_[axis].counters();
        state.enabled[axis] = axes_[axis].enabled();
        state.timing_violations += axes_[axis].violations().total();
        if (axis < kSlideCount) state.pressed[axis] = axes_[axis].pressed();
    }
    for (std::size_t heater = 0; heater < kHeaterCount; ++heater) {
        state.celsius[heater] = sensor_celsius(now, static_cast<int>(heater));
        state.block_celsius[heater] = heaters_[heater].block_celsius();
        state.heater_duty[heater] = heaters_[heater].duty();
        state.heater_off_since[heater] = heaters_[heater].off_since();
    }
    state.fan_duty = fan_duty_;
    state.conversions = conversions_;
    return state;
}

void Printer::inject(const Fault& fault) {
    pending_faults_.push_back(fault);
    std::ranges::stable_sort(pending_faults_, std::ranges::greater{}, &Fault::at);
    next_fault_ = pending_faults_.back().at;
}

void Printer::apply_due_faults(Instant now) {
    while (!pending_faults_.empty() && pending_faults_.back().at <= now) {
        const Fault fault = pending_faults_.back();
        pending_faults_.pop_back();
        for (Heater& heater : heaters_) heater.advance(fault.at);
        apply(fault);
    }
    next_fault_ = pending_faults_.empty() ? kForever : pending_faults_.back().at;
}

void Printer::apply(const Fault& fault) {
    const std::size_t which = fault.which;
    switch (fault.kind) {
        case FaultKind::sensor_stuck:
        case FaultKind::sensor_open:
        case FaultKind::sensor_short:
            sensors_[which] = {fault.kind, heaters_[which].sensor_celsius()};
            return;
        case FaultKind::heater_disconnected:
            heaters_[which].set_connected(false);
            return;
        case FaultKind::heater_stuck_on:
            heaters_[which].set_stuck_on(true);
            return;
        case FaultKind::bus_silent:
            bus_silent_ = true;
            return;
        case FaultKind::endstop_stuck_closed:
        case FaultKind::endstop_stuck_open:
            switches_[which] = fault.kind;
            return;
        case FaultKind::motor_disconnected:
            axes_[which].set_connected(false);
            return;
    }
}

void Printer::clear_faults(Instant now) {
    for (Heater& heater : heaters_) {
        heater.advance(now);
        heater.set_connected(true);
        heater.set_stuck_on(false);
    }
    sensors_.fill({});
    switches_.fill({});
    bus_silent_ = false;
    for (AxisDrive& axis : axes_) axis.set_connected(true);
    pending_faults_.clear();
    next_fault_ = kForever;
}

}  // namespace qduino::twin
