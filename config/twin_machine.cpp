#include "config/twin_machine.h"

#include <algorithm>
#include <cmath>

#include "config/machine_file.h"
#include "config/toml_section.h"

namespace qduino::apps {
namespace {

void copy_heater(const printer::HeaterConfig& from, twin::HeaterSpec& to) {
    to.heater_pin = from.heater_pin;
    to.adc_channel = from.adc_channel;
    to.power_w = from.model.power_w;
    to.heat_capacity_j_k = from.model.heat_capacity_j_k;
    to.loss_w_k = from.model.loss_w_k;
    to.fan_loss_share = from.model.fan_loss_w_k / from.model.loss_w_k;
    to.sensor_lag_s = from.model.sensor_lag_s;
    to.plastic_j_mm3_k = from.model.filament_j_mm3_k;
    to.sensor = device::TemperatureSensor{from.sensor};
}

/// How much higher than the nozzle in the middle a delta's carriage is.
double carriage_rise(const twin::DeltaSpec& delta) {
    return std::sqrt(std::max(delta.arm_mm * delta.arm_mm - delta.radius_mm * delta.radius_mm, 0.0));
}

/// At power-on each carriage of a delta hangs so much higher than the next: off the middle, as
/// after somebody has moved the head.
constexpr double kCarriageStartStep_mm = 2.5;

/// X, Y and Z of a delta are carriages on columns; the switch is at the top of each. The last
/// carriage hangs `lowest_mm` below its switch at power-on.
void stand_up(twin::Machine& twin, const printer::KinematicsConfig& from, double lowest_mm) {
    twin.delta = {from.delta_radius.value(), from.arm_length.value(), from.tower_angle_degrees};
    for (std::size_t tower = 0; tower < printer::kTowerCount; ++tower) {
        twin::AxisSpec& to = twin.axes[tower];
        const double height = from.home_height.value() + carriage_rise(twin.delta);
        to.trigger_mm = to.home_mm = height + from.endstop_offset[tower].value();
        to.hard_maximum_mm = to.trigger_mm + 2;
        to.hard_minimum_mm = 0;
        const double higher_mm =
            kCarriageStartStep_mm * static_cast<double>(printer::kTowerCount - 1 - tower);
        to.start_mm = to.trigger_mm - std::max(lowest_mm - higher_mm, 0.0);
    }
}

void wire(twin::AxisSpec& to, const printer::AxisConfig& from) {
    to.steps_per_mm = from.steps_per_mm;
    to.step_pin = from.step_pin;
    to.direction_pin = from.direction_pin;
    to.enable_pin = from.enable_pin;
    to.direction_inverted = from.direction_inverted;
    const double fastest_steps_s = from.max_speed.value() * from.steps_per_mm;
    to.motor.pull_out_steps_s = std::max(to.motor.pull_out_steps_s, 1.25 * fastest_steps_s);
    to.motor.acceleration_steps_s2 =
        std::max(to.motor.acceleration_steps_s2, 1.25 * from.max_acceleration.value() * from.steps_per_mm);
    to.shaper = {static_cast<twin::Shaper>(from.shaper.type), from.shaper.frequency_hz,
                 from.shaper.damping_ratio};
    to.top_speed_mm_s = from.max_speed.value();
    to.top_acceleration_mm_s2 = from.max_acceleration.value();
    to.corner_mm_s = from.instantaneous_speed.value();
}

/// At power-on the far end of a slide hangs a little lower.
constexpr double kExtraMotorStartMm = -0.2;

void add_extra_motors(twin::Machine& twin, std::size_t slide, const printer::AxisConfig& from) {
    for (const printer::ExtraMotor& motor : from.extra_motors) {
        const bool own_switch = motor.endstop_pin != printer::kNoPin;
        twin.extra_motors.push_back({static_cast<std::uint8_t>(slide), motor.step_pin, motor.direction_pin,
                                     motor.enable_pin, own_switch ? motor.endstop_pin : twin::kNotWired,
                                     own_switch ? kExtraMotorStartMm : 0});
    }
}

void lay_bed(twin::Machine& twin, const printer::MachineConfig& config) {
    const printer::ProbeConfig& probe = config.probe;
    twin.probe = {probe.pin == printer::kNoPin ? twin::kNotWired : probe.pin, probe.x_offset.value(),
                  probe.y_offset.value(), probe.trigger_height.value()};
    const printer::MeshConfig& mesh = config.mesh;
    for (std::size_t i = 0; i < 2; ++i) {
        twin.grid.minimum_mm[i] = mesh.minimum[i].value();
        twin.grid.maximum_mm[i] = mesh.maximum[i].value();
        twin.grid.points[i] = static_cast<int>(mesh.points[i]);
    }
    twin.grid.bicubic = mesh.surface == printer::MeshSurface::bicubic;
    twin.grid.clearance_mm = mesh.clearance.value();
    twin.grid.fade_start_mm = mesh.fade_start.value();
    twin.grid.fade_end_mm = mesh.fade_end.value();
    // The hill stands beside the middle of what is measured.
    twin.bed.middle_x_mm = (twin.grid.minimum_mm[0] + twin.grid.maximum_mm[0]) / 2;
    twin.bed.middle_y_mm = (twin.grid.minimum_mm[1] + twin.grid.maximum_mm[1]) / 2;
    twin.bed.hill_x_mm = twin.bed.middle_x_mm + 20;
    twin.bed.hill_y_mm = twin.bed.middle_y_mm - 15;
    twin.skew = {config.skew.xy, config.skew.xz, config.skew.yz};
}

/// What a job may name comes from where the job does: the printer's own files.
std::vector<twin::KnownBedSpec> known_beds(const printer::MachineConfig& config, const twin::GridSpec& grid) {
    std::vector<twin::KnownBedSpec> known;
    for (const printer::KeptBed& bed : config.beds) {
        known.push_back({std::string{bed.name.view()}, grid, {}, bed.in_force});
        twin::KnownBedSpec& spec = known.back();
        for (std::size_t i = 0; i < 2; ++i) {
            spec.grid.minimum_mm[i] = bed.minimum[i].value();
            spec.grid.maximum_mm[i] = bed.maximum[i].value();
            spec.grid.points[i] = static_cast<int>(bed.points[i]);
        }
        for (std::size_t row = 0; row < bed.points[1]; ++row)
            spec.heights.insert(spec.heights.end(), bed.heights[row].begin(),
                                bed.heights[row].begin() + static_cast<std::ptrdiff_t>(bed.points[0]));
    }
    return known;
}

void read_melt(TomlSection& s, twin::MeltSpec& melt) {
    s.number("pressure_s", melt.pressure_s, 0.001, 2);
    s.number("idle_ooze_mm3", melt.idle_ooze_mm3, 0, 100);
    s.number("idle_ooze_s", melt.idle_ooze_s, 0.1, 10000);
}

}  // namespace

twin::Machine twin_machine(const printer::MachineConfig& config) {
    twin::Machine twin;
    twin.gantry = static_cast<twin::GantryType>(config.kinematics.type);
    for (std::size_t i = 0; i < printer::kAxisCount; ++i) {
        const printer::AxisConfig& from = config.axes[i];
        twin::AxisSpec& to = twin.axes[i];
        wire(to, from);
        if (i == static_cast<std::size_t>(printer::Axis::e)) continue;
        add_extra_motors(twin, i, from);
        to.endstop_pin = from.endstop_pin;
        to.endstop_pressed_low = from.endstop_pressed_low;
        to.trigger_at_minimum = from.home_towards_minimum;
        to.trigger_mm = to.home_mm = from.home_position.value();
        to.hard_minimum_mm = std::min(from.minimum, from.home_position).value() - 2;
        to.hard_maximum_mm = std::max(from.maximum, from.home_position).value() + 2;
        to.start_mm = expected_place(from).value();
    }
    copy_heater(config.hot_end, twin.heaters[twin::kHotEnd]);
    copy_heater(config.bed, twin.heaters[twin::kBed]);
    if (!config.has_bed) twin.heaters[twin::kBed].heater_pin = twin::kNotWired;
    twin.ambient_celsius = config.room.value();
    lay_bed(twin, config);
    const printer::AxisConfig& z = config.axes[printer::Axis::z];
    if (twin.gantry == twin::GantryType::delta)
        stand_up(twin, config.kinematics, (z.home_position - expected_place(z)).value());
    twin.known_beds = known_beds(config, twin.grid);
    if (config.dialect) twin.flavour = static_cast<twin::Flavour>(*config.dialect);
    for (const printer::Macro& macro : config.macros)
        twin.macros.push_back({std::string{macro.name.view()}, std::string{macro.text.view()}});
    twin.filament_diameter_mm = config.filament_diameter.value();
    twin.advance_s = config.pressure_advance.advance.value();
    twin.smooth_s = config.pressure_advance.smooth_time.value();
    twin.nozzle_diameter_mm = config.nozzle_diameter.value();
    twin.fan_pin = config.fan_pin;
    twin.adc_address = config.adc_address;
    return twin;
}

Result<twin::Machine> read_twin_machine(const std::filesystem::path& twin_path,
                                        const std::filesystem::path& machine_path,
                                        const printer::MachineConfig& config) {
    if (twin_path.empty() && !machine_path.empty()) return twin_machine(config);
    if (twin_path.empty()) {
        twin::Machine reference;
        reference.known_beds = known_beds(config, reference.grid);
        return reference;
    }
    twin::MeltSpec melt;
    const auto read_more = [&](TomlSection& root) {
        root.table("melt", [&](TomlSection& s) { read_melt(s, melt); });
    };
    QDUINO_TRY_ASSIGN(const printer::MachineConfig metal, read_machine_file(twin_path, read_more));
    twin::Machine machine = twin_machine(metal);
    machine.melt = melt;
    // What a job asks for, its macros too, comes from where the job does.
    if (machine.macros.empty()) machine.macros = twin_machine(config).macros;
    machine.flavour = twin_machine(config).flavour;
    machine.known_beds = known_beds(config, machine.grid);
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
