#include "Printer.h"

#include <Arduino.h>
#include <Wire.h>

#include "PrinterWiring.h"
#include "board/board.h"
#include "device/ads7828.h"
#include "printer/step/step_cost.h"

namespace qduino::sketches {

using board::Level;
using board::PinId;

// ---- pins ---------------------------------------------------------------------------------------

Instant StepperPins::now() { return board::current().now(); }
void StepperPins::busy_until(Instant t) { board::current().busy_until(t); }
void StepperPins::sleep_until(Instant t) { board::current().sleep_until(t); }

void StepperPins::set_step(int axis, bool high) {
    board::current().pin_write(PinId{config_.axes[axis].step_pin}, high ? Level::high : Level::low);
}

void StepperPins::set_direction(int axis, bool positive) {
    const printer::AxisConfig& a = config_.axes[axis];
    board::current().pin_write(PinId{a.direction_pin},
                               positive != a.direction_inverted ? Level::high : Level::low);
}

bool StepperPins::endstop_pressed(int axis) {
    return board::current().pin_read(PinId{config_.axes[axis].endstop_pin}) == Level::high;
}

void EnablePins::switch_motor(printer::Axis axis, bool on) {
    board::current().pin_write(PinId{config_.axes[axis].enable_pin}, on ? Level::low : Level::high);
}

// ---- start --------------------------------------------------------------------------------------

struct Printer::Parts {
    explicit Parts(const PrinterWiring& wiring)
        : config(wiring.config),
          enables(config),
          machine(config, *wiring.link, enables),
          stepper_pins(config),
          stepper(stepper_pins, machine.motion().ring(), machine.motion().stops(), machine.motion().readers(),
                  wiring.link->motion_status, printer::step::player_settings(config)) {}

    printer::MachineConfig config;
    EnablePins enables;
    printer::machine::Machine machine;
    StepperPins stepper_pins;
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
        begin_output(axis.enable_pin, HIGH);  // low would switch the motor's driver on
        begin_output(axis.step_pin, LOW);
        digitalWrite(axis.direction_pin, LOW);
        pinMode(axis.direction_pin, OUTPUT);
        if (i < 3) pinMode(axis.endstop_pin, INPUT_PULLUP);
    }
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

void Printer::measure_steps() {
    measures_steps_ = false;
    const Nanoseconds cost = printer::step::measure_step_cost(parts_->stepper_pins);
    printer_wiring().link->step_cost_ns.store(cost.count(), std::memory_order_relaxed);
}

// ---- loop 3 -------------------------------------------------------------------------------------

std::optional<Celsius> Printer::read_thermistor(std::uint8_t channel) {
    Wire.beginTransmission(parts_->config.adc_address);
    Wire.write(device::ads7828::command_byte(channel));
    if (Wire.endTransmission(false) != 0) return std::nullopt;
    if (Wire.requestFrom(parts_->config.adc_address, std::uint8_t{2}) != 2) return std::nullopt;
    std::array<std::uint8_t, 2> bytes{};
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(Wire.read());
    const double fraction = device::ads7828::fraction(device::ads7828::decode(bytes));
    const Result<Celsius> celsius = thermistor_.celsius(fraction);
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
    readings.hot_end = read_thermistor(parts_->config.hot_end.adc_channel);
    if (parts_->config.has_bed) readings.bed = read_thermistor(parts_->config.bed.adc_channel);
    drive_heaters(parts_->machine.heat_sample(board::current().now(), readings));
}

}  // namespace qduino::sketches
