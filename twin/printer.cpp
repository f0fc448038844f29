#include "twin/printer.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/contract.h"

namespace qduino::twin {

using board::Level;
using board::PinId;

namespace {

/// A sensor whose contact ages reads ever colder than it is, down to a cold room.
constexpr double kDriftCelsius_s = 0.5;
constexpr double kDriftsTo = 10;

/// Where the motors stand at power-on, in microsteps.
Counts start_of(const Machine& machine) {
    Position start{};
    for (std::size_t i = 0; i < kAxisCount; ++i) start[i] = machine.axes[i].start_mm;
    if (machine.gantry != GantryType::delta) start = Gantry{machine}.motors_at(start);
    Counts steps{};
    for (std::size_t i = 0; i < kAxisCount; ++i)
        steps[i] = std::llround(start[i] * machine.axes[i].steps_per_mm);
    return steps;
}

AxisDrive drive_for(const AxisSpec& spec, std::int64_t position) {
    return {spec.motor, spec.direction_inverted, position};
}

Slide slide_for(const Machine& machine, std::size_t slide, const Counts& motors) {
    const Gantry gantry{machine};
    const AxisSpec& spec = machine.axes[slide];
    return {spec, gantry.slide_steps_per_mm(slide, spec.steps_per_mm), gantry.slide_steps(slide, motors)};
}

}  // namespace

Printer::Printer(const Machine& machine)
    : machine_(machine),
      gantry_(machine),
      motors_(start_of(machine)),
      axes_{{drive_for(machine.axes[0], motors_[0]), drive_for(machine.axes[1], motors_[1]),
             drive_for(machine.axes[2], motors_[2]), drive_for(machine.axes[3], motors_[3])}},
      slides_{
          {slide_for(machine, 0, motors_), slide_for(machine, 1, motors_), slide_for(machine, 2, motors_)}},
      heaters_{
          {{machine.heaters[0], machine.ambient_celsius}, {machine.heaters[1], machine.ambient_celsius}}},
      converter_(machine.adc_reference_v),
      volume_per_step_mm3_(machine.step_volume_mm3()) {
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
        const AxisSpec& spec = machine.axes[axis];
        wire(spec.step_pin, Role::step, axis);
        wire(spec.direction_pin, Role::direction, axis);
        wire(spec.enable_pin, Role::enable, axis);
        if (axis < kSlideCount) wire(spec.endstop_pin, Role::endstop, axis);
    }
    for (const ExtraMotorSpec& spec : machine.extra_motors) add_extra(spec);
    for (std::size_t heater = 0; heater < kHeaterCount; ++heater)
        wire(machine.heaters[heater].heater_pin, Role::heater, heater);
    wire(machine.fan_pin, Role::fan, 0);
    wire(machine.probe.pin, Role::probe, 0);
}

void Printer::wire(std::uint16_t pin, Role role, std::size_t index) {
    if (pin == kNotWired) return;
    QDUINO_EXPECT(pin < board::kPinCount);
    // Drivers may share an enable line.
    QDUINO_EXPECT(wires_[pin].role == Role::none || role == Role::enable);
    wires_[pin] = {role, static_cast<std::uint8_t>(index)};
}

/// Its number follows those of the first motors.
void Printer::add_extra(const ExtraMotorSpec& spec) {
    QDUINO_EXPECT(spec.slide < kSlideCount);
    const AxisSpec& first = machine_.axes[spec.slide];
    const std::int64_t start = motors_[spec.slide] + std::llround(spec.start_mm * first.steps_per_mm);
    extras_.push_back({drive_for(first, start), Slide{first, first.steps_per_mm, start}});
    const std::size_t motor = kAxisCount + extras_.size() - 1;
    wire(spec.step_pin, Role::step, motor);
    wire(spec.direction_pin, Role::direction, motor);
    wire(spec.enable_pin, Role::enable, motor);
    wire(spec.endstop_pin, Role::endstop, motor);
}

AxisDrive& Printer::drive_of(std::size_t motor) {
    return motor < kAxisCount ? axes_[motor] : extras_[motor - kAxisCount].drive;
}
const Slide& Printer::slide_of(std::size_t index) const {
    return index < kSlideCount ? slides_[index] : extras_[index - kAxisCount].slide;
}

const AxisSpec& Printer::axis_of(std::size_t index) const {
    return machine_.axes[index < kSlideCount ? index : machine_.extra_motors[index - kAxisCount].slide];
}

void Printer::pin_written(Instant now, PinId pin, Level level) {
    if (pin.number >= board::kPinCount) return;
    if (now >= faults_.next) [[unlikely]]
        apply_due_faults(now);
    driven_[pin.number] = level;
    const Wire wire = wires_[pin.number];
    const bool high = level == Level::high;
    switch (wire.role) {
        case Role::step:
            return step_pin(now, wire.index, high);
        case Role::direction:
            return drive_of(wire.index).write_direction(now, high);
        case Role::enable:
            for (std::size_t axis = 0; axis < kAxisCount; ++axis)
                if (machine_.axes[axis].enable_pin == pin.number) axes_[axis].write_enable(high);
            for (std::size_t i = 0; i < extras_.size(); ++i)
                if (machine_.extra_motors[i].enable_pin == pin.number) extras_[i].drive.write_enable(high);
            return;
        case Role::heater:
        case Role::fan:
            return drive(now, wire, high ? 1.0 : 0.0);
        case Role::endstop:
        case Role::probe:
        case Role::none:
            return;
    }
}

bool Printer::has_room(std::size_t motor, std::int64_t wanted) const {
    Counts there = motors_;
    there[motor] = wanted;
    for (unsigned left = gantry_.slides_of(motor); left != 0; left &= left - 1) {
        const auto slide = static_cast<std::size_t>(std::countr_zero(left));
        if (!slides_[slide].has_room_at(gantry_.slide_steps(slide, there))) return false;
    }
    return true;
}

void Printer::step_pin(Instant now, std::size_t motor, bool level) {
    if (motor >= kAxisCount) return extra_step_pin(now, motor - kAxisCount, level);
    AxisDrive& drive = axes_[motor];
    const int direction =
        drive.write_step(now, level, [&](std::int64_t wanted) { return has_room(motor, wanted); });
    if (direction == 0) return;
    motors_[motor] = drive.position();
    // What was drawn back is molten already.
    if (motor == kExtruder && drive.position() > melted_to_) {
        melted_to_ = drive.position();
        heaters_[kHotEnd].advance(now);
        heaters_[kHotEnd].melt(volume_per_step_mm3_);
    }
    if (observer_)
        observer_->on_step(
            {now, static_cast<std::uint8_t>(motor), static_cast<std::int8_t>(direction), drive.position()});
    for (unsigned left = gantry_.slides_of(motor); left != 0; left &= left - 1) {
        const auto slide = static_cast<std::size_t>(std::countr_zero(left));
        if (slides_[slide].update(now, gantry_.slide_steps(slide, motors_)) && observer_)
            observer_->on_endstop(now, static_cast<int>(slide), slides_[slide].pressed());
    }
}

void Printer::extra_step_pin(Instant now, std::size_t which, bool level) {
    Extra& extra = extras_[which];
    const int direction = extra.drive.write_step(
        now, level, [&](std::int64_t wanted) { return extra.slide.has_room_at(wanted); });
    if (direction == 0) return;
    static_cast<void>(extra.slide.update(now, extra.drive.position()));
    if (observer_) observer_->on_extra_step(which, extra.drive.position());
}

void Printer::drive(Instant now, Wire wire, double duty) {
    if (wire.role == Role::heater) {
        heaters_[wire.index].set_duty(now, duty);
    } else if (wire.role == Role::fan) {
        fan_.duty = duty;
        for (Heater& heater : heaters_) heater.set_fan(now, fan_.dead ? 0 : duty);
    }
}

void Printer::pwm_written(Instant now, PinId pin, double duty) {
    if (pin.number >= board::kPinCount) return;
    if (now >= faults_.next) apply_due_faults(now);
    drive(now, wires_[pin.number], std::clamp(duty, 0.0, 1.0));
}

// A bouncing contact alternates every 100 µs until it has settled, ending on its new level.
bool Printer::contact(Instant now, std::size_t index) const {
    const Slide& slide = slide_of(index);
    const Nanoseconds since = now - slide.switched_at();
    const Nanoseconds bounce = axis_of(index).bounce;
    if (since < bounce && (since / Nanoseconds{100'000}) % 2 != 0) return !slide.pressed();
    return slide.pressed();
}

bool Printer::probe_closes(Instant now) {
    Position motors{};
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
        motors[axis] = static_cast<double>(motors_[axis]) / machine_.axes[axis].steps_per_mm;
    const Position nozzle = gantry_.nozzle_at(motors);
    const ProbeSpec& probe = machine_.probe;
    const double bed = machine_.bed.height_at(nozzle[0] + probe.x_offset_mm, nozzle[1] + probe.y_offset_mm);
    const bool closes = nozzle[2] <= bed + probe.trigger_height_mm;
    if (closes && !probe_closed_ && observer_) observer_->on_probe(now);
    probe_closed_ = closes;
    return closes;
}

Level Printer::pin_level(Instant now, PinId pin) {
    if (pin.number >= board::kPinCount) return Level::low;
    if (now >= faults_.next) apply_due_faults(now);
    const Wire wire = wires_[pin.number];
    if (wire.role == Role::probe) return probe_closes(now) ? Level::high : Level::low;
    if (wire.role != Role::endstop) return driven_[pin.number];
    const std::optional<FaultKind> fault =
        wire.index < kSlideCount ? switches_[wire.index] : std::optional<FaultKind>{};
    const bool closed = fault ? *fault == FaultKind::endstop_stuck_closed : contact(now, wire.index);
    return closed != axis_of(wire.index).endstop_pressed_low ? Level::high : Level::low;
}

double Printer::sensor_celsius(Instant now, int heater) {
    if (now >= faults_.next) apply_due_faults(now);
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
        double celsius = sensor_celsius(now, static_cast<int>(heater));
        if (sensor.fault == FaultKind::sensor_stuck) celsius = sensor.celsius;
        if (sensor.fault == FaultKind::sensor_drifts)
            celsius = std::max(celsius - kDriftCelsius_s * to_seconds(now - sensor.since), kDriftsTo);
        return machine_.adc_reference_v * spec.sensor.fraction(Celsius{celsius});
    }
    return 0.0;
}

Result<void> Printer::i2c_transfer(Instant now, board::I2cBus bus, board::I2cAddress address,
                                   std::span<const std::uint8_t> out, std::span<std::uint8_t> in) {
    if (now >= faults_.next) apply_due_faults(now);
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
        state.position_steps[axis] = motors_[axis];
        state.position_mm[axis] = static_cast<double>(motors_[axis]) / machine_.axes[axis].steps_per_mm;
        state.counters[axis] = axes_[axis].counters();
        state.enabled[axis] = axes_[axis].enabled();
        state.timing_violations += axes_[axis].violations().total();
        if (axis < kSlideCount) state.pressed[axis] = slides_[axis].pressed();
    }
    state.position_mm = gantry_.nozzle_at(state.position_mm);
    for (const Extra& extra : extras_) state.timing_violations += extra.drive.violations().total();
    for (std::size_t heater = 0; heater < kHeaterCount; ++heater) {
        state.celsius[heater] = sensor_celsius(now, static_cast<int>(heater));
        state.block_celsius[heater] = heaters_[heater].block_celsius();
        state.heater_duty[heater] = heaters_[heater].duty();
        state.heater_off_since[heater] = heaters_[heater].off_since();
    }
    state.fan_duty = fan_.duty;
    state.conversions = conversions_;
    return state;
}

void Printer::inject(const Fault& fault) {
    faults_.pending.push_back(fault);
    std::ranges::stable_sort(faults_.pending, std::ranges::greater{}, &Fault::at);
    faults_.next = faults_.pending.back().at;
}

void Printer::apply_due_faults(Instant now) {
    while (!faults_.pending.empty() && faults_.pending.back().at <= now) {
        const Fault fault = faults_.pending.back();
        faults_.pending.pop_back();
        for (Heater& heater : heaters_) heater.advance(fault.at);
        apply(fault);
    }
    faults_.next = faults_.pending.empty() ? kForever : faults_.pending.back().at;
}

void Printer::apply(const Fault& fault) {
    const std::size_t which = fault.which;
    switch (fault.kind) {
        case FaultKind::sensor_stuck:
        case FaultKind::sensor_open:
        case FaultKind::sensor_short:
        case FaultKind::sensor_drifts:
            sensors_[which] = {fault.kind, heaters_[which].sensor_celsius(), fault.at};
            return;
        case FaultKind::fan_dead:
            fan_.dead = true;
            for (Heater& heater : heaters_) heater.set_fan(fault.at, 0);
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
    bus_silent_ = fan_.dead = false;
    for (Heater& heater : heaters_) heater.set_fan(now, fan_.duty);
    for (AxisDrive& axis : axes_) axis.set_connected(true);
    faults_.pending.clear();
    faults_.next = kForever;
}

}  // namespace qduino::twin
