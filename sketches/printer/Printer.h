// The printer as an Arduino library: the pure machine (printer/machine) on real pins and buses.
//
//   loop 1  plan()   commands, G-code, look-ahead, steps into the ring            30 of 100 ms
//   loop 2  step()   pulses out of the ring, each at its instant                  its own core
//   loop 3  heat()   two thermistors through the ADS7828, PID, heaters and fan    1 of 8 ms
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>

#include "base/fixed_vector.h"
#include "base/quantity.h"
#include "base/time.h"
#include "board/types.h"
#include "device/temperature_sensor.h"
#include "printer/machine/machine.h"
#include "printer/step/stepper_loop.h"

namespace qduino::sketches {

/// The player's pins: STEP, DIR and endstop of each motor. Motors of one axis step together, but
/// for those that have a switch of their own while the axis homes.
class StepperPins {
  public:
    explicit StepperPins(const printer::MachineConfig& config);
    [[nodiscard]] Instant now();
    void busy_until(Instant t);
    void sleep_until(Instant t);
    void set_steps(const printer::step::MotorList& axes, bool high);
    void set_direction(int axis, bool positive);
    [[nodiscard]] bool endstop_pressed(int axis);
    void watch_switches(int axis, bool on);
    /// The heaters' outputs off: loop 3 writes them otherwise.
    void cut_heat();

  private:
    static constexpr std::size_t kMotorsMax = 1 + printer::kExtraMotorsMax;  // of an axis
    /// The pins of an axis' motors, the first motor in front.
    using MotorPins = FixedVector<board::PinId, kMotorsMax>;
    struct Axis {
        MotorPins step;
        MotorPins direction;
        bool watched = false;
        unsigned stopped = 0;  // bit per motor: at its switch
        [[nodiscard]] bool is_plain() const { return step.size() == 1 && !watched && stopped == 0; }
    };
    void stop_at_switches(int axis);
    [[nodiscard]] static bool is_high(std::uint16_t pin);
    [[nodiscard]] static bool is_pressed(const printer::AxisConfig& axis, std::uint16_t pin);

    const printer::MachineConfig& config_;
    std::array<Axis, printer::kAxisCount> axes_{};
};

/// The drivers' ENABLE pins; low enables.
class EnablePins final : public printer::machine::MotorSwitch {
  public:
    explicit EnablePins(const printer::MachineConfig& config) : config_(config) {}
    void switch_motor(printer::Axis motor, bool on) override;

  private:
    const printer::MachineConfig& config_;
};

class Printer {
  public:
    /// In setup(): pins to their start levels, safe states declared, the machine made. Takes
    /// printer_wiring().
    void begin();

    void plan();  ///< one release of loop 1
    void step();  ///< one slice of loop 2: spins through what is due, sleeps while nothing is
    void heat();  ///< one release of loop 3

  private:
    /// Everything that exists from begin() on, made once.
    struct Parts;

    [[nodiscard]] std::optional<Celsius> read_sensor(std::uint8_t channel,
                                                     const device::TemperatureSensor& sensor);
    void drive_heaters(const printer::heat::HeatDuties& duties);

    void measure_steps();

    std::shared_ptr<Parts> parts_;
    bool measures_steps_ = false;  ///< loop 2 has yet to
};

}  // namespace qduino::sketches

using qduino::sketches::Printer;
