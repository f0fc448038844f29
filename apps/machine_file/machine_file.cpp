#include "apps/machine_file/machine_file.h"

#include <string>

#include "apps/toml/toml_section.h"

namespace qduino::apps {
namespace {

using printer::Axis;
using printer::AxisConfig;
using printer::HeaterConfig;
using printer::MachineConfig;

/// Shorter, and heaters would go off while a person reads what the page says.
constexpr Seconds kIdleTimeoutMin{30};

constexpr int kLastPin = 127;

using Section = TomlSection;

void read_axis(Section& s, AxisConfig& a) {
    s.number("steps_per_mm", a.steps_per_mm, 0.1, 100000);
    s.number("max_speed_mm_s", a.max_speed, 0.01, 2000);
    s.number("max_acceleration_mm_s2", a.max_acceleration, 0.1, 200000);
    s.number("instantaneous_speed_mm_s", a.instantaneous_speed, 0, 200);
    s.number("minimum_mm", a.minimum, -10000, 10000);
    s.number("maximum_mm", a.maximum, -10000, 10000);
    s.number("home_speed_mm_s", a.home_speed, 0.01, 500);
    s.number("home_retreat_mm", a.home_retreat, 0.01, 50);
    s.number("home_position_mm", a.home_position, -10000, 10000);
    s.flag("home_towards_minimum", a.home_towards_minimum);
    s.flag("direction_inverted", a.direction_inverted);
    s.integer("step_pin", a.step_pin, 0, kLastPin);
    s.integer("direction_pin", a.direction_pin, 0, kLastPin);
    s.integer("enable_pin", a.enable_pin, 0, kLastPin);
    s.integer("endstop_pin", a.endstop_pin, 0, kLastPin);
}

void read_heater(Section& s, HeaterConfig& h) {
    s.number("kp", h.kp, 0, 10000);
    s.number("ki", h.ki, 0, 10000);
    s.number("kd", h.kd, 0, 10000);
    s.number("minimum_celsius", h.minimum, -50, 50);
    s.number("maximum_celsius", h.maximum, 30, 500);
    s.integer("heater_pin", h.heater_pin, 0, kLastPin);
    s.integer("adc_channel", h.adc_channel, 0, 7);
    s.number("verify_gain_celsius", h.verify_gain_celsius, 0.1, 50);
    s.number("verify_gain_s", h.verify_gain_time, 1, 600);
    s.number("verify_hysteresis_celsius", h.verify_hysteresis_celsius, 0.5, 50);
    s.number("verify_error_celsius_s", h.verify_error_celsius_s, 1, 10000);
    s.number("at_target_celsius", h.at_target_celsius, 0.1, 20);
    s.number("at_target_s", h.at_target_time, 0, 60);
}

/// The default place is the corner where the bed can be reached freely.
void read_park(Section& s, printer::ParkConfig& p) {
    s.flag("enabled", p.enabled);
    s.number("x_mm", p.x, -10000, 10000);
    s.number("y_mm", p.y, -10000, 10000);
    s.number("z_hop_mm", p.z_hop, 0, 100);
    s.number("retract_mm", p.retract, 0, 20);
    s.number("speed_mm_s", p.speed, 1, 2000);
    s.number("retract_speed_mm_s", p.retract_speed, 0.1, 200);
}

/// [macros]: each key is a word of a job, its text the lines that it stands for.
void read_macros(Section& s, MachineConfig& m) {
    s.each_text([&](const std::string& name, const std::string& lines) -> std::string {
        printer::Macro macro;
        for (const char c : name)
            macro.name.push_back(c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c);
        macro.text.assign(lines);
        if (macro.text.size() < lines.size())
            return text<std::string>("has more than ", decltype(macro.text)::kCapacity, " bytes");
        if (name.size() < 2 || name.size() > decltype(macro.name)::kCapacity)
            return "is no word of 2 to 32 letters, digits and _";
        const bool kept = m.macros.try_push_back(macro);
        return kept ? "" : text<std::string>("is one macro more than ", printer::kMacrosMax);
    });
}

void read_machine(Section& s, MachineConfig& m) {
    s.text("name", m.name);
    s.table("axes", [&](Section& axes) {
        axes.table("x", [&](Section& a) { read_axis(a, m.axes[Axis::x]); });
        axes.table("y", [&](Section& a) { read_axis(a, m.axes[Axis::y]); });
        axes.table("z", [&](Section& a) { read_axis(a, m.axes[Axis::z]); });
        axes.table("e", [&](Section& a) { read_axis(a, m.axes[Axis::e]); });
    });
    s.number("default_acceleration_mm_s2", m.default_acceleration, 0.1, 200000);
    s.number("travel_acceleration_mm_s2", m.travel_acceleration, 0.1, 200000);
    s.number("minimum_extrude_celsius", m.minimum_extrude, 0, 400);
    s.number("idle_timeout_s", m.idle_timeout, 0, 86400);
    m.park.x = m.axes[Axis::x].minimum;
    m.park.y = m.axes[Axis::y].maximum;
    s.table("park", [&](Section& p) { read_park(p, m.park); });
    s.table("hot_end", [&](Section& h) { read_heater(h, m.hot_end); });
    s.table("bed", [&](Section& h) { read_heater(h, m.bed); });
    s.flag("has_bed", m.has_bed);
    s.integer("fan_pin", m.fan_pin, 0, kLastPin);
    s.integer("adc_address", m.adc_address, 0, 127);
    s.number("step_pulse_s", m.step_pulse, 0, 1e-3);
    s.number("step_low_s", m.step_low, 0, 1e-3);
    s.number("direction_setup_s", m.direction_setup, 0, 1e-3);
    s.number("step_cost_s", m.step_cost, 0, 1e-3);
    s.number("filament_diameter_mm", m.filament_diameter, 0.5, 5);
    s.table("macros", [&](Section& macros) { read_macros(macros, m); });
    s.number("nozzle_diameter_mm", m.nozzle_diameter, 0.05, 3);
}

/// Empty when the park place is inside the axis' bounds.
std::string outside_axis(const char* key, Millimetres place, const AxisConfig& axis) {
    if (place >= axis.minimum && place <= axis.maximum) return {};
    return text<std::string>("park: ", key, " is ", Shortest{place.value()}, ", outside the axis' ",
                             Shortest{axis.minimum.value()}, " to ", Shortest{axis.maximum.value()});
}

/// Rules between keys.
std::string contradictions(const MachineConfig& m) {
    for (const Axis axis : {Axis::x, Axis::y, Axis::z}) {
        if (m.axes[axis].minimum < m.axes[axis].maximum) continue;
        return std::string("axis ") + printer::kAxisLetter[axis] + ": minimum_mm is not below maximum_mm";
    }
    if (m.idle_timeout > Seconds{0} && m.idle_timeout < kIdleTimeoutMin) {
        return "idle_timeout_s: give 0 (never) or at least " +
               std::to_string(static_cast<int>(kIdleTimeoutMin.value())) + " s";
    }
    const std::string error = outside_axis("x_mm", m.park.x, m.axes[Axis::x]);
    return error.empty() ? outside_axis("y_mm", m.park.y, m.axes[Axis::y]) : error;
}

}  // namespace

Result<MachineConfig> parse_machine(std::string_view text, std::string_view name) {
    MachineConfig machine;
    std::string error = read_toml(text, name, [&](Section& root) { read_machine(root, machine); });
    if (error.empty()) error = contradictions(machine);
    if (!error.empty()) return make_error(ErrorCode::invalid_argument, error);
    return machine;
}

Result<MachineConfig> read_machine_file(const std::filesystem::path& path) {
    if (path.empty()) return MachineConfig{};
    const Result<std::string> read = posix::read_small_file(path);
    if (read) return parse_machine(*read, path.filename().string());
    return make_error(ErrorCode::not_found, "machine file ", path.native(),
                      " cannot be read: check its path");
}

}  // namespace qduino::apps
