#include "apps/machine_file/machine_file.h"

#include <toml++/toml.h>

#include <fstream>
#include <limits>
#include <optional>
#include <sstream>
#include <string>
#include <type_traits>
#include <vector>

namespace qduino::apps {
namespace {

using printer::Axis;
using printer::AxisConfig;
using printer::HeaterConfig;
using printer::MachineConfig;

/// Shorter, and heaters would go off while a person reads what the page says.
constexpr Seconds kIdleTimeoutMin{30};

std::string where(std::string_view name, const toml::source_region& source) {
    return std::string(name) + ":" + std::to_string(source.begin.line) + ": ";
}

/// One table of the file: takes keys out by name, and blames those that were not taken.
class Section {
  public:
    Section(const toml::table& table, std::string_view name, std::string& error)
        : table_(table), name_(name), error_(error) {}

    void number(const char* key, double& value, double minimum, double maximum) {
        const toml::node* node = take(key);
        if (!node) return;
        const std::optional<double> given = node->value<double>();
        if (!given || !node->is_number()) return blame(*node, key, "is not a number");
        if (!(*given >= minimum && *given <= maximum)) {
            std::ostringstream text;
            text << "is " << *given << ", outside " << minimum << " to " << maximum;
            return blame(*node, key, text.str());
        }
        value = *given;
    }
    /// A quantity, in the unit that the key ends with.
    template <typename Quantity>
    void number(const char* key, Quantity& value, double minimum, double maximum) {
        double given = value.value();
        number(key, given, minimum, maximum);
        value = Quantity{given};
    }
    void number(const char* key, Nanoseconds& value, double minimum_s, double maximum_s) {
        double given_s = to_seconds(value);
        number(key, given_s, minimum_s, maximum_s);
        value = from_seconds(given_s);
    }
    void pin(const char* key, std::uint16_t& value) {
        double number_value = value;
        number(key, number_value, 0, 127);
        value = static_cast<std::uint16_t>(number_value);
    }
    void byte(const char* key, std::uint8_t& value, double maximum) {
        double number_value = value;
        number(key, number_value, 0, maximum);
        value = static_cast<std::uint8_t>(number_value);
    }
    void flag(const char* key, bool& value) {
        const toml::node* node = take(key);
        if (!node) return;
        const std::optional<bool> given = node->value_exact<bool>();
        if (!given) return blame(*node, key, "is neither true nor false");
        value = *given;
    }
    template <std::size_t N>
    void text(const char* key, FixedString<N>& value) {
        const toml::node* node = take(key);
        if (!node) return;
        const std::optional<std::string> given = node->value_exact<std::string>();
        if (!given) return blame(*node, key, "is not a text");
        value.assign(*given);
    }
    template <typename Read>
    void table(const char* key, Read read) {
        const toml::node* node = take(key);
        if (!node) return;
        const toml::table* inner = node->as_table();
        if (!inner) return blame(*node, key, "is not a table");
        Section section{*inner, name_, error_};
        read(section);
        section.finish();
    }
    void finish() {
        for (const auto& [key, node] : table_) {
            bool known = false;
            for (const std::string& taken : taken_) known = known || taken == key.str();
            if (!known)
                blame(node, std::string(key.str()).c_str(),
                      "is not known here (docs/machine.md lists the keys)");
        }
    }

  private:
    const toml::node* take(const char* key) {
        taken_.emplace_back(key);
        return table_.get(key);
    }
    void blame(const toml::node& node, const char* key, const std::string& what) {
        if (error_.empty()) error_ = where(name_, node.source()) + "'" + key + "' " + what;
    }

    const toml::table& table_;
    std::string_view name_;
    std::string& error_;
    std::vector<std::string> taken_;
};

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
    s.pin("step_pin", a.step_pin);
    s.pin("direction_pin", a.direction_pin);
    s.pin("enable_pin", a.enable_pin);
    s.pin("endstop_pin", a.endstop_pin);
}

void read_heater(Section& s, HeaterConfig& h) {
    s.number("kp", h.kp, 0, 10000);
    s.number("ki", h.ki, 0, 10000);
    s.number("kd", h.kd, 0, 10000);
    s.number("minimum_celsius", h.minimum, -50, 50);
    s.number("maximum_celsius", h.maximum, 30, 500);
    s.pin("heater_pin", h.heater_pin);
    s.byte("adc_channel", h.adc_channel, 7);
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
    s.pin("fan_pin", m.fan_pin);
    s.byte("adc_address", m.adc_address, 127);
    s.number("step_pulse_s", m.step_pulse, 0, 1e-3);
    s.number("step_low_s", m.step_low, 0, 1e-3);
    s.number("direction_setup_s", m.direction_setup, 0, 1e-3);
    s.number("filament_diameter_mm", m.filament_diameter, 0.5, 5);
    s.number("nozzle_diameter_mm", m.nozzle_diameter, 0.05, 3);
}

/// Empty when the park place is inside the axis' bounds.
std::string outside_axis(const char* key, Millimetres place, const AxisConfig& axis) {
    if (place >= axis.minimum && place <= axis.maximum) return {};
    std::ostringstream text;
    text << "park: " << key << " is " << place.value() << ", outside the axis' " << axis.minimum.value()
         << " to " << axis.maximum.value();
    return text.str();
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
    try {
        const toml::table table = toml::parse(text);
        MachineConfig machine;
        std::string error;
        Section root{table, name, error};
        read_machine(root, machine);
        root.finish();
        if (error.empty()) error = contradictions(machine);
        if (!error.empty()) return make_error(ErrorCode::invalid_argument, error);
        return machine;
    } catch (const toml::parse_error& parse_error) {
        return make_error(ErrorCode::invalid_argument,
                          where(name, parse_error.source()) + std::string(parse_error.description()));
    }
}

Result<MachineConfig> read_machine_file(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) {
        return make_error(ErrorCode::not_found,
                          "machine file " + path.string() + " cannot be read: check its path");
    }
    std::ostringstream text;
    text << file.rdbuf();
    return parse_machine(text.str(), path.filename().string());
}

}  // namespace qduino::apps
