#include "apps/machine_file/twin_machine.h"

#include <algorithm>

#include "apps/machine_file/machine_file.h"

namespace qduino::apps {

twin::Machine twin_machine(const printer::MachineConfig& config) {
    twin::Machine twin;
    for (std::size_t i = 0; i < printer::kAxisCount; ++i) {
        const printer::AxisConfig& from = config.axes[i];
        twin::AxisSpec& to = twin.axes[i];
        to.steps_per_mm = from.steps_per_mm;
        to.step_pin = from.step_pin;
        to.direction_pin = from.direction_pin;
        to.enable_pin = from.enable_pin;
        to.direction_inverted = from.direction_inverted;
        const double fastest_steps_s = from.max_speed.value() * from.steps_per_mm;
        to.motor.pull_out_steps_s = std::max(to.motor.pull_out_steps_s, 1.25 * fastest_steps_s);
        to.motor.acceleration_steps_s2 = std::max(to.motor.acceleration_steps_s2,
                                                  1.25 * from.max_acceleration.value() * from.steps_per_mm);
        if (i == static_cast<std::size_t>(printer::Axis::e)) continue;
        to.endstop_pin = from.endstop_pin;
        to.trigger_at_minimum = from.home_towards_minimum;
        to.trigger_mm = to.home_mm = from.home_position.value();
        to.hard_minimum_mm = std::min(from.minimum, from.home_position).value() - 2;
        to.hard_maximum_mm = std::max(from.maximum, from.home_position).value() + 2;
        to.start_mm = std::clamp(to.start_mm, from.minimum.value(), from.maximum.value());
    }
    twin.heaters[twin::kHotEnd].heater_pin = config.hot_end.heater_pin;
    twin.heaters[twin::kHotEnd].adc_channel = config.hot_end.adc_channel;
    twin.heaters[twin::kBed].heater_pin = config.has_bed ? config.bed.heater_pin : twin::kNotWired;
    twin.heaters[twin::kBed].adc_channel = config.bed.adc_channel;
    for (const printer::Macro& macro : config.macros)
        twin.macros.push_back({std::string{macro.name.view()}, std::string{macro.text.view()}});
    twin.filament_diameter_mm = config.filament_diameter.value();
    twin.fan_pin = config.fan_pin;
    twin.adc_address = config.adc_address;
    return twin;
}

Result<twin::Machine> read_twin_machine(const std::filesystem::path& twin_path,
                                        const std::filesystem::path& machine_path,
                                        const printer::MachineConfig& config) {
    if (twin_path.empty()) return machine_path.empty() ? twin::Machine{} : twin_machine(config);
    QDUINO_TRY_ASSIGN(const printer::MachineConfig metal, read_machine_file(twin_path));
    twin::Machine machine = twin_machine(metal);
    // What a job asks for, its macros too, comes from where the job does.
    if (machine.macros.empty()) machine.macros = twin_machine(config).macros;
    return machine;
}

Result<std::vector<twin::Fault>> parse_faults(const std::vector<std::string>& words) {
    std::vector<twin::Fault> faults;
    for (const std::string& word : words) {
        QDUINO_TRY_ASSIGN(const twin::Fault fault, twin::parse_fault(word));
        faults.push_back(fault);
    }
    return faults;
}

}  // namespace qduino::apps
