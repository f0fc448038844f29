#include "Printer.h"

#include <Arduino.h>
#include <Wire.h>

#include <algorithm>

#include "PrinterWiring.h"
#include "board/board.h"
#include "device/ads7828.h"
#include "printer/step/step_cost.h"

namespace qduino::sketches {

using board::Level;
using board::PinId;

// ---- pins ---------------------------------------------------------------------------------------

StepperPins::StepperPins(const printer::MachineConfig& config) : config_(config) {
    for (std::size_t i = 0; i < axes_.size(); ++i) {
        const printer::AxisConfig& axis = config.axes[i];
        axes_[i].step.push_back(PinId{axis.step_pin});
        axes_[i].direction.push_back(PinId{axis.direction_pin});
        for (const printer::ExtraMotor& motor : axis.extra_motors) {
            axes_[i].step.push_back(PinId{motor.step_pin});
            axes_[i].direction.push_back(PinId{motor.direction_pin});
        }
    }
}

Instant StepperPins::now() { return board::current().now(); }
void StepperPins::busy_until(Instant t) { board::current().busy_until(t); }
void StepperPins::sleep_until(Instant t) { board::current().sleep_until(t); }

void StepperPins::set_steps(const printer::step::MotorList& axes, bool high) {
    const Level level = high ? Level::high : Level::low;
    // Most steps are of one motor, which is alone on its axis.
    if (axes.size() == 1 && axes_[axes.front()].is_plain()) [[likely]]
        return board::current().pin_write(axes_[axes.front()].step.front(), level);
    FixedVector<PinId, printer::kAxisCount * kMotorsMax> pins;
    for (const int number : axes) {
        Axis& axis = axes_[number];
        if (axis.watched && high) [[unlikely]]
            stop_at_switches(number);
        unsigned stopped = high ? axis.stopped : 0;
        for (const PinId pin : axis.step) {
            if ((stopped & 1u) == 0) pins.push_back(pin);
            stopped >>= 1;
        }
    }
    board::current().pins_write(pins, level);
}

void StepperPins::set_direction(int axis, bool positive) {
    const bool high = positive != config_.axes[axis].direction_inverted;
    board::current().pins_write(axes_[axis].direction, high ? Level::high : Level::low);
}

bool StepperPins::is_high(std::uint16_t pin) { return board::current().pin_read(PinId{pin}) == Level::high; }

bool StepperPins::is_pressed(const printer::AxisConfig& axis, std::uint16_t pin) {
    return is_high(pin) != axis.endstop_pressed_low;
}

bool StepperPins::endstop_pressed(int axis) {
    if (axis == static_cast<int>(printer::step::kProbeSwitch)) return is_high(config_.probe.pin);
    const printer::AxisConfig& a = config_.axes[axis];
    if (!is_pressed(a, a.endstop_pin) && (axes_[axis].stopped & 1u) == 0) return false;
    for (std::size_t i = 0; i < a.extra_motors.size(); ++i) {
        const std::uint16_t own = a.extra_motors[i].endstop_pin;
        if (own != printer::kNoPin && (axes_[axis].stopped >> (i + 1) & 1u) == 0 && !is_pressed(a, own))
            return false;
    }
    return true;
}

void StepperPins::watch_switches(int axis, bool on) {
    const auto& extra = config_.axes[axis].extra_motors;
    axes_[axis].watched = on && std::ranges::any_of(extra, [](const auto& motor) {
                              return motor.endstop_pin != printer::kNoPin;
                          });
    axes_[axis].stopped = 0;
}

void StepperPins::cut_heat() {
    static_cast<void>(board::current().pwm_write(PinId{config_.hot_end.heater_pin}, 0.0));
    if (config_.has_bed) static_cast<void>(board::current().pwm_write(PinId{config_.bed.heater_pin}, 0.0));
}

void StepperPins::stop_at_switches(int axis) {
    const printer::AxisConfig& a = config_.axes[axis];
    const bool first = is_pressed(a, a.endstop_pin);
    if (first) axes_[axis].stopped |= 1u;
    for (std::size_t i = 0; i < a.extra_motors.size(); ++i) {
        const std::uint16_t own = a.extra_motors[i].endstop_pin;
        if (own == printer::kNoPin ? first : is_pressed(a, own)) axes_[axis].stopped |= 2u << i;
    }
}

void EnablePins::switch_motor(printer::Axis motor, bool on) {
    const printer::AxisConfig& a = config_.axes[motor];
    const Level level = on ? Level::low : Level::high;
    board::current().pin_write(PinId{a.enable_pin}, level);
    for (const printer::ExtraMotor& extra : a.extra_motors)
        board::current().pin_write(PinId{extra.enable_pin}, level);
}

// ---- start --------------------------------------------------------------------------------------

struct Printer::Parts {
    explicit Parts(const PrinterWiring& wiring)
        : config(wiring.config),
          hot_end(wiring.config.hot_end.sensor),
          bed(wiring.config.bed.sensor),
          enables(config),
          machine(config, *wiring.link, enables),
          stepper_pins(config),
          stepper(stepper_pins, machine.motion().ring(), machine.motion().stops(), machine.motion().readers(),
                  wiring.link->motion_status, printer::step::player_settings(config)) {}

    printer::MachineConfig config;
    device::TemperatureSensor hot_end, bed;
    EnablePins enables;
    printer::machine::Machine machine;
    StepperPins stepper_pins;
    printer::step::StepCost step_cost;
    printer::step::StepperLoop<StepperPins, printer::machine::StepRing, printer::machine::Stops> stepper;
};

namespace {

/// An output that is at `level` from the first instant on: the latch is set before the pin is
/// driven, and the supervisor knows the safe level before that.
void begin_output(std::uint16_t pin, int level) {
    safeState(pin, level);
    digitalWrite(pin, level);
    pinMode(pin, OUTPUT);
}

/// A driver's three inputs: off, and no step.
void begin_driver(std::uint16_t step_pin, std::uint16_t direction_pin, std::uint16_t enable_pin) {
    begin_output(enable_pin, HIGH);  // low would switch the motor's driver on
    begin_output(step_pin, LOW);
    digitalWrite(direction_pin, LOW);
    pinMode(direction_pin, OUTPUT);
}

}  // namespace

void Printer::begin() {
    const PrinterWiring& wiring = printer_wiring();
    for (const std::uint16_t heater :
         {wiring.config.hot_end.heater_pin, wiring.config.bed.heater_pin, wiring.config.fan_pin}) {
        begin_output(heater, LOW);
        analogWrite(heater, 0);
    }
    for (std::size_t i = 0; i < printer::kAxisCount; ++i) {
        const printer::AxisConfig& axis = wiring.config.axes[i];
        begin_driver(axis.step_pin, axis.direction_pin, axis.enable_pin);
        if (i < 3) pinMode(axis.endstop_pin, INPUT_PULLUP);
        for (const printer::ExtraMotor& extra : axis.extra_motors) {
            begin_driver(extra.step_pin, extra.direction_pin, extra.enable_pin);
            if (extra.endstop_pin != printer::kNoPin) pinMode(extra.endstop_pin, INPUT_PULLUP);
        }
    }
    if (wiring.config.probe.pin != printer::kNoPin) pinMode(wiring.config.probe.pin, INPUT_PULLUP);
    Wire.begin();
    parts_ = std::make_shared<Parts>(wiring);
    measures_steps_ = wiring.measure_steps;
}

// ---- loop 1 -------------------------------------------------------------------------------------

void Printer::plan() {
    parts_->machine.plan(board::current().now());
    // Loop 3 cannot: it has fallen silent.
    if (parts_->machine.heat_silent()) drive_heaters({});
}

// ---- loop 2 -------------------------------------------------------------------------------------

void Printer::step() {
    if (measures_steps_) [[unlikely]]
        measure_steps();
    parts_->stepper.step();
}

/// One batch in each pass, until all are measured or something is to be played: a stop that comes
/// meanwhile is served in time.
void Printer::measure_steps() {
    const auto& ring = parts_->machine.motion().ring();
    const bool at_rest = ring.empty() && ring.popped() == 0;
    if (at_rest) parts_->step_cost.measure(parts_->stepper_pins);
    if (at_rest && !parts_->step_cost.done()) return;
    measures_steps_ = false;
    printer_wiring().link->step_cost_ns.store(parts_->step_cost.one_step().count(),
                                              std::memory_order_relaxed);
}

// ---- loop 3 -------------------------------------------------------------------------------------

std::optional<Celsius> Printer::read_sensor(std::uint8_t channel, const device::TemperatureSensor& sensor) {
    Wire.beginTransmission(parts_->config.adc_address);
    Wire.write(device::ads7828::command_byte(channel));
    if (Wire.endTransmission(false) != 0) return std::nullopt;
    if (Wire.requestFrom(parts_->config.adc_address, std::uint8_t{2}) != 2) return std::nullopt;
    std::array<std::uint8_t, 2> bytes{};
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(Wire.read());
    const double fraction = device::ads7828::fraction(device::ads7828::decode(bytes));
    const Result<Celsius> celsius = sensor.celsius(fraction);
    return celsius.ok() ? std::optional{*celsius} : std::nullopt;
}

void Printer::drive_heaters(const printer::heat::HeatDuties& duties) {
    const auto duty = [](double value) { return static_cast<int>(value * 255.0 + 0.5); };
    analogWrite(parts_->config.hot_end.heater_pin, duty(duties.hot_end));
    if (parts_->config.has_bed) analogWrite(parts_->config.bed.heater_pin, duty(duties.bed));
    analogWrite(parts_->config.fan_pin, duty(duties.fan));
}

void Printer::heat() {
    printer::heat::HeatReadings readings;
    readings.hot_end = read_sensor(parts_->config.hot_end.adc_channel, parts_->hot_end);
    if (parts_->config.has_bed) readings.bed = read_sensor(parts_->config.bed.adc_channel, parts_->bed);
    drive_heaters(parts_->machine.heat_sample(board::current().now(), readings));
}

}  // namespace qduino::sketches
