#include "config/machine_rules.h"

#include <array>
#include <initializer_list>
#include <string_view>
#include <vector>

#include "base/text.h"
#include "printer/kinematics.h"
#include "printer/probe_grid.h"

namespace qduino::apps {
namespace {

using printer::Axis;
using printer::AxisConfig;
using printer::HeaterConfig;
using printer::Kinematics;
using printer::KinematicsType;
using printer::MachineConfig;
using Broken = std::optional<BrokenRule>;

/// Shorter, and heaters would go off while a person reads what the page says.
constexpr Seconds kIdleTimeoutMin{30};

/// How far an arm may reach sideways, as a share of its length. Beyond that its carriage would run
/// away from the nozzle.
constexpr double kFlattestArm = 0.97;

constexpr std::array<const char*, printer::kAxisCount> kAxisNames{"x", "y", "z", "e"};

template <typename... Pieces>
Broken broken(std::string path, const Pieces&... what) {
    return BrokenRule{std::move(path), text<std::string>(what...)};
}

std::string key_of(std::size_t axis, const char* key) {
    return text<std::string>("axes.", kAxisNames[axis], '.', key);
}

// ---- axes ---------------------------------------------------------------------------------------

Broken axis_rule(const MachineConfig& m, std::size_t i) {
    const AxisConfig& a = m.axes[i];
    const double most_hz = 1 / to_seconds(printer::step_interval(m));
    if (const double fastest_hz = a.max_speed.value() * a.steps_per_mm; fastest_hz > most_hz) {
        return broken(key_of(i, "max_speed_mm_s"), "'max_speed_mm_s' would be ", Fixed{fastest_hz, 0},
                      " steps/s; step_pulse_s, step_low_s and direction_setup_s leave ", Fixed{most_hz, 0},
                      ": at most ", Fixed{most_hz / a.steps_per_mm, 1}, " mm/s");
    }
    if (i == static_cast<std::size_t>(Axis::e)) return {};
    if (!(a.minimum < a.maximum)) {
        return broken(key_of(i, "minimum_mm"), "'minimum_mm' is ", Shortest{a.minimum.value()},
                      ", not below maximum_mm, ", Shortest{a.maximum.value()});
    }
    const bool beyond = a.home_towards_minimum ? a.home_position > a.maximum : a.home_position < a.minimum;
    if (beyond) {
        return broken(key_of(i, "home_position_mm"), "'home_position_mm' is ",
                      Shortest{a.home_position.value()}, ", beyond the other end of the axis, ",
                      Shortest{(a.home_towards_minimum ? a.maximum : a.minimum).value()},
                      ": correct it, or home_towards_minimum");
    }
    if (a.home_speed > a.max_speed) {
        return broken(key_of(i, "home_speed_mm_s"), "'home_speed_mm_s' is above max_speed_mm_s, ",
                      Shortest{a.max_speed.value()});
    }
    if (a.home_retreat.value() >= (a.maximum - a.minimum).value()) {
        return broken(key_of(i, "home_retreat_mm"), "'home_retreat_mm' is longer than the axis, ",
                      Shortest{(a.maximum - a.minimum).value()}, " mm");
    }
    return {};
}

Broken park_rule(const char* key, Millimetres place, const AxisConfig& axis) {
    if (place >= axis.minimum && place <= axis.maximum) return {};
    return broken(text<std::string>("park.", key), "[park] '", key, "' is ", Shortest{place.value()},
                  ", outside the axis' ", Shortest{axis.minimum.value()}, " to ",
                  Shortest{axis.maximum.value()});
}

// ---- kinematics, bed ----------------------------------------------------------------------------

Broken delta_rule(const MachineConfig& m) {
    const printer::KinematicsConfig& k = m.kinematics;
    if (k.arm_length <= k.delta_radius) {
        return broken("kinematics.arm_length_mm",
                      "[kinematics] 'arm_length_mm' is not above delta_radius_mm, ",
                      Shortest{k.delta_radius.value()});
    }
    // Opposite a tower, at the edge of the bed, its arm lies flattest.
    if (const double flattest = (k.delta_radius + k.bed_radius).value();
        flattest > kFlattestArm * k.arm_length.value()) {
        return broken("kinematics.arm_length_mm",
                      "[kinematics] the arms are too short for bed_radius_mm: at least ",
                      Fixed{flattest / kFlattestArm, 1}, " mm");
    }
    for (const Axis axis : {Axis::x, Axis::y, Axis::z}) {
        if (!m.axes[axis].home_towards_minimum) continue;
        return broken(key_of(static_cast<std::size_t>(axis), "home_towards_minimum"),
                      "a delta's switches are at the top: 'home_towards_minimum' is false");
    }
    if (!Kinematics{m}.is_on_bed(m.park.x.value(), m.park.y.value(), 0)) {
        return broken("park.x_mm", "[park] 'x_mm' and 'y_mm' are outside of kinematics.bed_radius_mm, ",
                      Shortest{k.bed_radius.value()});
    }
    return {};
}

Broken kinematics_rule(const MachineConfig& m) {
    if (m.kinematics.type == KinematicsType::delta) return delta_rule(m);
    if (m.kinematics.type != KinematicsType::corexy) return {};
    if (m.axes[Axis::x].steps_per_mm == m.axes[Axis::y].steps_per_mm) return {};
    return broken(key_of(1, "steps_per_mm"), "the belts of CoreXY need the same 'steps_per_mm' for x and y, ",
                  Shortest{m.axes[Axis::x].steps_per_mm});
}

/// The rule for the points of the bed mesh. Only a machine with a probe can break it.
Broken grid_rule(const MachineConfig& m) {
    if (m.probe.pin == printer::kNoPin) return {};
    const Kinematics kinematics{m};
    for (std::size_t i = 0; i < 2; ++i) {
        if (m.mesh.minimum[i] < m.mesh.maximum[i]) continue;
        return broken(text<std::string>("bed_mesh.minimum_", kAxisNames[i], "_mm"),
                      "[bed_mesh] a minimum is not below its maximum");
    }
    for (std::size_t point = 0; point < probe_count(m.mesh); ++point) {
        const printer::ProbePlace place = probe_place(m, point);
        const bool inside = place.x >= m.axes[0].minimum && place.x <= m.axes[0].maximum &&
                            place.y >= m.axes[1].minimum && place.y <= m.axes[1].maximum;
        if (inside && kinematics.is_on_bed(place.x.value(), place.y.value(), 0)) continue;
        return broken("probe.pin", "[bed_mesh] the nozzle does not reach X ", Shortest{place.x.value()},
                      ", Y ", Shortest{place.y.value()}, " to probe there");
    }
    if (m.mesh.fade_end > Millimetres{0} && m.mesh.fade_end <= m.mesh.fade_start) {
        return broken("bed_mesh.fade_end_mm", "[bed_mesh] 'fade_end_mm' is not above fade_start_mm, ",
                      Shortest{m.mesh.fade_start.value()});
    }
    return {};
}

Broken shaper_rule(const MachineConfig& m) {
    for (const Axis axis : {Axis::x, Axis::y}) {
        const printer::ShaperConfig& shaper = m.axes[axis].shaper;
        if (shaper.type == printer::ShaperType::none || shaper.active()) continue;
        return broken(key_of(static_cast<std::size_t>(axis), "shaper.type"),
                      "a shaper needs 'frequency_hz', the resonance of its axis");
    }
    return {};
}

// ---- pins ---------------------------------------------------------------------------------------

/// Drivers may share an enable line; everything else has its pin to itself.
Broken pin_rule(const MachineConfig& m) {
    struct Use {
        std::string path;
        int pin;
        bool enable;
    };
    std::vector<Use> uses;
    const auto use = [&](std::string path, int pin, bool enable = false) {
        uses.push_back({std::move(path), pin, enable});
    };
    for (std::size_t i = 0; i < m.axes.size(); ++i) {
        use(key_of(i, "step_pin"), m.axes[i].step_pin);
        use(key_of(i, "direction_pin"), m.axes[i].direction_pin);
        use(key_of(i, "enable_pin"), m.axes[i].enable_pin, true);
        if (i != static_cast<std::size_t>(Axis::e)) use(key_of(i, "endstop_pin"), m.axes[i].endstop_pin);
        for (const printer::ExtraMotor& extra : m.axes[i].extra_motors) {
            use(key_of(i, "motors"), extra.step_pin);
            use(key_of(i, "motors"), extra.direction_pin);
            use(key_of(i, "motors"), extra.enable_pin, true);
            if (extra.endstop_pin != printer::kNoPin) use(key_of(i, "motors"), extra.endstop_pin);
        }
    }
    if (m.probe.pin != printer::kNoPin) use("probe.pin", m.probe.pin);
    use("hot_end.heater_pin", m.hot_end.heater_pin);
    if (m.has_bed) use("bed.heater_pin", m.bed.heater_pin);
    use("fan_pin", m.fan_pin);
    for (std::size_t i = 0; i < uses.size(); ++i) {
        for (std::size_t j = 0; j < i; ++j) {
            if (uses[i].pin != uses[j].pin || (uses[i].enable && uses[j].enable)) continue;
            return broken(uses[i].path, uses[i].path, ": pin ", uses[i].pin, " is ", uses[j].path,
                          " already: each needs a pin of its own");
        }
    }
    return {};
}

// ---- heat ---------------------------------------------------------------------------------------

Broken heater_rule(const char* table, const HeaterConfig& h) {
    const auto path = [&](const char* key) { return text<std::string>(table, '.', key); };
    const double highest = printer::highest_target(h).value();
    const device::TemperatureSensor sensor{h.sensor};
    if (!sensor.celsius(sensor.fraction(h.maximum))) {
        return broken(path("maximum_celsius"), '[', table, "] 'maximum_celsius' is ",
                      Shortest{h.maximum.value()},
                      ", more than the sensor can show with its pull_up_ohm: a short circuit would read so");
    }
    if (h.at_target_celsius >= h.verify_hysteresis_celsius) {
        return broken(path("at_target_celsius"), '[', table,
                      "] 'at_target_celsius' is not below verify_hysteresis_celsius, ",
                      Shortest{h.verify_hysteresis_celsius});
    }
    const double reaches = 20 + h.model.power_w / h.model.loss_w_k;
    if (h.control == printer::HeaterControl::model && reaches < highest) {
        return broken(path("model.power_w"), '[', table, ".model] 'power_w' heats to ", Fixed{reaches, 0},
                      " °C at most with this loss_w_k, and targets go up to ", Shortest{highest},
                      ": correct the model, or lower maximum_celsius");
    }
    return {};
}

Broken heat_rule(const MachineConfig& m) {
    if (const Broken found = heater_rule("hot_end", m.hot_end)) return found;
    if (printer::highest_target(m.hot_end) < m.minimum_extrude) {
        return broken("minimum_extrude_celsius", "'minimum_extrude_celsius' is ",
                      Shortest{m.minimum_extrude.value()}, ", above the hot end's highest target, ",
                      Shortest{printer::highest_target(m.hot_end).value()}, ": nothing could be printed");
    }
    if (m.minimum_extrude < m.minimum_extrude_floor) {
        return broken("minimum_extrude_floor_celsius", "'minimum_extrude_floor_celsius' is ",
                      Shortest{m.minimum_extrude_floor.value()}, ", above minimum_extrude_celsius, ",
                      Shortest{m.minimum_extrude.value()}, ": it is the lowest that M302 may set");
    }
    if (m.idle_timeout > Seconds{0} && m.idle_timeout < kIdleTimeoutMin) {
        return broken("idle_timeout_s", "'idle_timeout_s' is ", Shortest{m.idle_timeout.value()},
                      ": give 0 (never) or at least ", Shortest{kIdleTimeoutMin.value()}, " s");
    }
    if (!m.has_bed) return {};
    if (m.hot_end.adc_channel == m.bed.adc_channel) {
        return broken("bed.adc_channel", "[bed] 'adc_channel' is ", int{m.bed.adc_channel},
                      ", as the hot end's: each sensor needs a channel of its own");
    }
    return heater_rule("bed", m.bed);
}

}  // namespace

Broken broken_rule(const MachineConfig& m) {
    for (std::size_t i = 0; i < m.axes.size(); ++i) {
        if (const Broken found = axis_rule(m, i)) return found;
    }
    if (const Broken found = park_rule("x_mm", m.park.x, m.axes[Axis::x])) return found;
    if (const Broken found = park_rule("y_mm", m.park.y, m.axes[Axis::y])) return found;
    if (const Broken found = kinematics_rule(m)) return found;
    if (const Broken found = grid_rule(m)) return found;
    if (const Broken found = shaper_rule(m)) return found;
    if (const Broken found = pin_rule(m)) return found;
    return heat_rule(m);
}

}  // namespace qduino::apps
