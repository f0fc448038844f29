#include "config/machine_check.h"

#include <cmath>

#include "base/text.h"

namespace qduino::apps {
namespace {

using printer::Axis;
using printer::HeaterConfig;

constexpr double kRoomCelsius = 20;
/// What a converter of 12 bits tells apart.
constexpr double kConverterStep = 1.0 / 4096;

void write_axis(std::string& out, char letter, const printer::AxisConfig& axis, bool has_bounds) {
    write(out, "  ", letter, "  ");
    if (has_bounds)
        write(out, Shortest{axis.minimum.value()}, " to ", Shortest{axis.maximum.value()}, " mm, ");
    write(out, Shortest{axis.max_speed.value()}, " mm/s, ", Shortest{axis.max_acceleration.value()},
          " mm/s², ", Shortest{axis.steps_per_mm}, " steps/mm: at most ",
          Fixed{axis.max_speed.value() * axis.steps_per_mm, 0}, " steps/s\n");
}

/// Where the converter's last bit is coarsest, for the temperatures of a print.
double kelvin_per_step(const HeaterConfig& heater, double celsius) {
    const device::TemperatureSensor sensor{heater.sensor};
    return kConverterStep /
           std::abs(sensor.fraction(Celsius{celsius + 0.5}) - sensor.fraction(Celsius{celsius - 0.5}));
}

void write_heater(std::string& out, const char* name, const HeaterConfig& heater, double celsius) {
    celsius = std::min(celsius, printer::highest_target(heater).value());
    const double seconds = printer::waiting_time_s(heater.model, kRoomCelsius, celsius,
                                                   heater.at_target_celsius, heater.at_target_time.value());
    write(out, "  ", name, "  to ", Shortest{printer::highest_target(heater).value()}, " °C, by its ",
          printer::kHeaterControlNames(heater.control), "; read in steps of ",
          Fixed{kelvin_per_step(heater, celsius)}, " °C at ", Shortest{celsius}, " °C");
    if (std::isfinite(seconds)) {
        write(out, ", from ", Shortest{kRoomCelsius}, " °C in ", Fixed{seconds, 0}, " s\n");
    } else {
        out += ", which its model says it never reaches\n";
    }
}

}  // namespace

std::string describe(const printer::MachineConfig& machine, std::string_view file) {
    auto out = text<std::string>(file, ": a machine, ", machine.name.view(), '\n');
    for (const Axis axis : {Axis::x, Axis::y, Axis::z, Axis::e})
        write_axis(out, printer::kAxisLetter[axis], machine.axes[axis], axis != Axis::e);
    write_heater(out, "hot end", machine.hot_end, 205);
    if (machine.has_bed) write_heater(out, "bed", machine.bed, 60);
    return out;
}

}  // namespace qduino::apps
