#include "config/machine_file.h"

#include <array>
#include <charconv>
#include <cmath>
#include <string>
#include <vector>

#include "config/machine_rules.h"
#include "config/toml_section.h"
#include "printer/axis_reach.h"
#include "printer/kinematics.h"

namespace qduino::apps {
namespace {

using printer::Axis;
using printer::AxisConfig;
using printer::HeaterConfig;
using printer::MachineConfig;

constexpr int kLastPin = 127;

using printer::KinematicsType;

constexpr Words<KinematicsType::cartesian, KinematicsType::delta> kTypeWords{"cartesian", "corexy", "delta"};
/// In the order of the towers.
constexpr std::array<const char*, printer::kTowerCount> kOffsetKeys{
    "endstop_offset_x_mm", "endstop_offset_y_mm", "endstop_offset_z_mm"};
constexpr std::array<const char*, printer::kTowerCount> kAngleKeys{
    "tower_angle_x_degrees", "tower_angle_y_degrees", "tower_angle_z_degrees"};
constexpr Words<device::SensorKind::beta, device::SensorKind::pt1000> kSensorNames{"beta", "steinhart_hart",
                                                                                   "pt1000"};

using Section = TomlSection;

constexpr Words<printer::ShaperType::none, printer::ShaperType::two_hump_ei> kShaperNames{
    "none", "zv", "zvd", "mzv", "ei", "2hump_ei"};

/// [axes.x.shaper], [axes.y.shaper].
void read_shaper(Section& s, printer::ShaperConfig& shaper) {
    s.choice("type", shaper.type, kShaperNames);
    s.number("frequency_hz", shaper.frequency_hz, printer::kShaperFrequencyMin_hz,
             printer::kShaperFrequencyMax_hz);
    s.number("damping_ratio", shaper.damping_ratio, 0, printer::kDampingRatioMax);
}

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
    s.number("expected_from_switch_mm", a.expected_from_switch, 0, 10000);
    s.flag("direction_inverted", a.direction_inverted);
    s.integer("step_pin", a.step_pin, 0, kLastPin);
    s.integer("direction_pin", a.direction_pin, 0, kLastPin);
    s.integer("enable_pin", a.enable_pin, 0, kLastPin);
    s.integer("endstop_pin", a.endstop_pin, 0, kLastPin);
    s.flag("endstop_pressed_low", a.endstop_pressed_low);
    std::vector<printer::ExtraMotor> extra;
    s.tables("motors", extra, {"step_pin", "direction_pin", "enable_pin"},
             [](Section& motor, printer::ExtraMotor& pins) {
                 motor.integer("step_pin", pins.step_pin, 0, kLastPin);
                 motor.integer("direction_pin", pins.direction_pin, 0, kLastPin);
                 motor.integer("enable_pin", pins.enable_pin, 0, kLastPin);
                 motor.integer("endstop_pin", pins.endstop_pin, 0, kLastPin);
             });
    for (const printer::ExtraMotor& pins : extra)
        if (!a.extra_motors.try_push_back(pins))
            s.fault("motors", text<std::string>("at most ", printer::kExtraMotorsMax, " more motors"));
}

/// How far below its switch a delta's lowest carriage is expected, if somebody has moved it.
constexpr Millimetres kDeltaHangs{35};

/// Without the key each job says it for itself.
void read_dialect(Section& s, MachineConfig& m) {
    constexpr Words<printer::Dialect::marlin, printer::Dialect::klipper> kWords{"marlin", "reprap",
                                                                                "klipper"};
    printer::Dialect dialect = printer::Dialect::marlin;
    s.choice("dialect", dialect, kWords);
    if (s.has("dialect")) m.dialect = dialect;
}

/// [kinematics]. A delta's axes get other defaults: its bed is round, its switches are at the top.
void read_kinematics(Section& s, MachineConfig& m) {
    printer::KinematicsConfig& k = m.kinematics;
    s.choice("type", k.type, kTypeWords);
    if (k.type != KinematicsType::delta) return;
    for (const char* key : {"delta_radius_mm", "arm_length_mm", "bed_radius_mm"}) s.require(key);
    s.number("delta_radius_mm", k.delta_radius, 10, 2000);
    s.number("arm_length_mm", k.arm_length, 10, 5000);
    s.number("bed_radius_mm", k.bed_radius, 1, 2000);
    for (std::size_t tower = 0; tower < printer::kTowerCount; ++tower) {
        s.number(kOffsetKeys[tower], k.endstop_offset[tower], -20, 20);
        s.number(kAngleKeys[tower], k.tower_angle_degrees[tower], -360, 360);
    }
    for (const Axis axis : {Axis::x, Axis::y, Axis::z}) {
        m.axes[axis].home_towards_minimum = false;
        if (axis == Axis::z) continue;
        m.axes[axis].minimum = -k.bed_radius;
        m.axes[axis].maximum = k.bed_radius;
    }
    m.axes[Axis::z].home_position = m.axes[Axis::z].maximum;
    m.axes[Axis::z].expected_from_switch = kDeltaHangs;
}

void read_model(Section& s, printer::HeaterModel& m) {
    s.number("power_w", m.power_w, 1, 5000);
    s.number("heat_capacity_j_k", m.heat_capacity_j_k, 0.1, 50000);
    s.number("loss_w_k", m.loss_w_k, 0.0001, 100);
    s.number("fan_loss_w_k", m.fan_loss_w_k, 0, 100);
    s.number("sensor_lag_s", m.sensor_lag_s, 0.1, 100);
    s.number("filament_j_mm3_k", m.filament_j_mm3_k, 0, 0.1);
}

/// A sensor has the keys of its type alone.
void read_sensor(Section& s, device::SensorSpec& sensor) {
    using device::SensorKind;
    s.choice("type", sensor.kind, kSensorNames);
    s.number("pull_up_ohm", sensor.pull_up_ohm, 100, 1e6);
    if (sensor.kind == SensorKind::beta) {
        s.number("r25_ohm", sensor.r25_ohm, 100, 1e7);
        s.number("beta_k", sensor.beta_k, 1000, 10000);
    } else if (sensor.kind == SensorKind::steinhart_hart) {
        for (const char* key : {"steinhart_a", "steinhart_b", "steinhart_c"}) s.require(key);
        s.number("steinhart_a", sensor.steinhart_a, -0.01, 0.01);
        s.number("steinhart_b", sensor.steinhart_b, 1e-6, 0.01);
        s.number("steinhart_c", sensor.steinhart_c, 0, 1e-4);
    }
}

void read_gains(Section& s, HeaterConfig& h) {
    s.number("kp", h.kp, 0, 10000);
    s.number("ki", h.ki, 0, 10000);
    s.number("kd", h.kd, 0, 10000);
}

void read_heater(Section& s, HeaterConfig& h) {
    // A heater whose gains are given and whose model is not is controlled by its gains.
    if (s.has("kp") && !s.has("model")) h.control = printer::HeaterControl::pid;
    s.choice("control", h.control, printer::kHeaterControlNames);
    read_gains(s, h);
    s.table("model", [&](Section& model) { read_model(model, h.model); });
    s.table("sensor", [&](Section& sensor) { read_sensor(sensor, h.sensor); });
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
    s.number("unload_mm", p.unload, 0, 1000);
    s.number("purge_mm", p.purge, 0, 200);
    s.number("purge_speed_mm_s", p.purge_speed, 0.1, 50);
}

/// A word as G-code takes it: a G28X would be read as a G28.
bool is_macro_name(std::string_view name) {
    constexpr std::string_view kDigits = "0123456789";
    constexpr std::string_view kOthers = "_abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ";
    const std::size_t digit = name.find_first_not_of(kOthers);
    return name.size() >= 2 && digit >= 2 &&
           name.find_first_not_of(std::string{kOthers}.append(kDigits)) == std::string_view::npos;
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
        if (!is_macro_name(name) || name.size() > decltype(macro.name)::kCapacity)
            return "is no word of 2 to 32 letters, digits and _, the first two no digits";
        for (std::size_t open = lines.find('{'); open != std::string::npos;
             open = lines.find('{', open + 1)) {
            const std::size_t end = lines.find_first_of("}\n", open);
            if (end == std::string::npos || lines[end] == '\n') return "has a { without its } in the line";
        }
        const bool kept = m.macros.try_push_back(macro);
        return kept ? "" : text<std::string>("is one macro more than ", printer::kMacrosMax);
    });
}

/// [start]: what homes and heats in front of a job that does not.
void read_start(Section& s, printer::StartConfig& start) {
    std::string lines;
    s.text("gcode", lines);
    start.text.assign(lines);
    if (start.text.size() < lines.size())
        s.fault("gcode", text<std::string>("has more than ", decltype(start.text)::kCapacity, " bytes"));
    s.number("hot_end_celsius", start.hot_end, 0, 400);
    s.number("bed_celsius", start.bed, 0, 400);
}

void read_probe(Section& s, printer::ProbeConfig& p) {
    s.require("pin");
    s.integer("pin", p.pin, 0, kLastPin);
    s.number("x_offset_mm", p.x_offset, -200, 200);
    s.number("y_offset_mm", p.y_offset, -200, 200);
    s.number("trigger_height_mm", p.trigger_height, -5, 20);
    s.number("speed_mm_s", p.speed, 0.1, 50);
}

constexpr Words<printer::MeshSurface::bilinear, printer::MeshSurface::bicubic> kSurfaceWords{"bilinear",
                                                                                             "bicubic"};

constexpr std::array<std::array<const char*, 3>, 2> kGridKeys{
    {{"minimum_x_mm", "maximum_x_mm", "points_x"}, {"minimum_y_mm", "maximum_y_mm", "points_y"}}};

void read_grid(Section& s, std::array<Millimetres, 2>& minimum, std::array<Millimetres, 2>& maximum,
               std::array<std::size_t, 2>& points) {
    for (std::size_t i = 0; i < 2; ++i) {
        s.number(kGridKeys[i][0], minimum[i], -10000, 10000);
        s.number(kGridKeys[i][1], maximum[i], -10000, 10000);
        s.integer(kGridKeys[i][2], points[i], 2, printer::kMeshPointsMax);
    }
}

void read_mesh(Section& s, printer::MeshConfig& mesh) {
    read_grid(s, mesh.minimum, mesh.maximum, mesh.points);
    s.choice("surface", mesh.surface, kSurfaceWords);
    s.number("clearance_mm", mesh.clearance, 0.5, 100);
    s.number("travel_speed_mm_s", mesh.travel_speed, 1, 2000);
    s.number("fade_start_mm", mesh.fade_start, 0, 1000);
    s.number("fade_end_mm", mesh.fade_end, 0, 1000);
}

void read_skew(Section& s, printer::SkewConfig& skew) {
    s.number("xy", skew.xy, -printer::kSkewMax, printer::kSkewMax);
    s.number("xz", skew.xz, -printer::kSkewMax, printer::kSkewMax);
    s.number("yz", skew.yz, -printer::kSkewMax, printer::kSkewMax);
}

/// By default the grid is as far from the edges as on the reference machine; of a round bed, the
/// square in it.
void place_grid(MachineConfig& m) {
    for (std::size_t i = 0; i < 2; ++i) {
        const Millimetres margin =
            m.kinematics.type == KinematicsType::delta ? m.kinematics.bed_radius * 0.45 : Millimetres{20};
        m.mesh.minimum[i] = m.axes[i].minimum + margin;
        m.mesh.maximum[i] = m.axes[i].maximum + -margin;
    }
}

void read_machine(Section& s, MachineConfig& m) {
    s.text("name", m.name);
    s.table("kinematics", [&](Section& k) { read_kinematics(k, m); });
    s.table("axes", [&](Section& axes) {
        for (const Axis axis : {Axis::x, Axis::y}) {
            axes.table(axis == Axis::x ? "x" : "y", [&](Section& a) {
                read_axis(a, m.axes[axis]);
                a.table("shaper", [&](Section& shaper) { read_shaper(shaper, m.axes[axis].shaper); });
            });
        }
        axes.table("z", [&](Section& a) { read_axis(a, m.axes[Axis::z]); });
        axes.table("e", [&](Section& a) { read_axis(a, m.axes[Axis::e]); });
    });
    m.kinematics.home_height = m.axes[Axis::z].home_position;
    place_delta_home(m);
    s.number("default_acceleration_mm_s2", m.default_acceleration, 0.1, 200000);
    s.number("travel_acceleration_mm_s2", m.travel_acceleration, 0.1, 200000);
    s.number("jerk_mm_s3", m.jerk_mm_s3, 0, 1e9);
    s.number("reversal_gap_s", m.reversal_gap, 0, 0.01);
    s.table("pressure_advance", [&](Section& p) {
        p.number("seconds", m.pressure_advance.advance, 0, printer::kAdvanceMax.value());
        p.number("smooth_time_s", m.pressure_advance.smooth_time, printer::kSmoothTimeMin.value(),
                 printer::kSmoothTimeMax.value());
    });
    s.number("minimum_extrude_celsius", m.minimum_extrude, 0, 400);
    m.minimum_extrude_floor = std::min(m.minimum_extrude_floor, m.minimum_extrude);
    s.number("minimum_extrude_floor_celsius", m.minimum_extrude_floor, 0, 400);
    s.number("idle_timeout_s", m.idle_timeout, 0, 86400);
    read_dialect(s, m);
    // A delta's round bed has no corner to park over. The next job homes from the park place.
    const bool is_delta = m.kinematics.type == KinematicsType::delta;
    m.park.x = is_delta ? Millimetres{0} : printer::before_the_switch(m.axes[Axis::x]).from;
    m.park.y = is_delta ? m.axes[Axis::y].maximum : printer::before_the_switch(m.axes[Axis::y]).to;
    s.table("park", [&](Section& p) { read_park(p, m.park); });
    s.table("hot_end", [&](Section& h) { read_heater(h, m.hot_end); });
    s.table("bed", [&](Section& h) { read_heater(h, m.bed); });
    s.number("room_celsius", m.room, -50, 100);
    s.flag("has_bed", m.has_bed);
    place_grid(m);
    s.table("probe", [&](Section& probe) { read_probe(probe, m.probe); });
    s.table("bed_mesh", [&](Section& mesh) { read_mesh(mesh, m.mesh); });
    s.table("skew", [&](Section& skew) { read_skew(skew, m.skew); });
    s.integer("fan_pin", m.fan_pin, 0, kLastPin);
    s.integer("adc_address", m.adc_address, 0, 127);
    s.number("step_pulse_s", m.step_pulse, 0, 1e-3);
    s.number("step_low_s", m.step_low, 0, 1e-3);
    s.number("direction_setup_s", m.direction_setup, 0, 1e-3);
    s.number("step_cost_s", m.step_cost, 0, 1e-3);
    s.number("filament_diameter_mm", m.filament_diameter, 0.5, 5);
    s.table("macros", [&](Section& macros) { read_macros(macros, m); });
    s.table("start", [&](Section& start) { read_start(start, m.start); });
    s.number("nozzle_diameter_mm", m.nozzle_diameter, 0.05, 3);
}

/// "0.1 0.2; 0.3 0.4": rows of heights. False: not as many as the grid has points, or no heights.
bool read_heights(std::string_view words, printer::KeptBed& bed) {
    constexpr double kHighest_mm = 100;
    const char* at = words.data();
    const char* const end = at + words.size();
    const auto skip = [&](char c) {
        while (at != end && (*at == ' ' || *at == c)) ++at;
    };
    for (std::size_t row = 0; row < bed.points[1]; ++row) {
        for (std::size_t column = 0; column < bed.points[0]; ++column) {
            double& height = bed.heights[row][column];
            const auto [next, failed] = std::from_chars(at, end, height);
            if (failed != std::errc{} || !(std::abs(height) <= kHighest_mm)) return false;
            at = next;
            skip(column + 1 == bed.points[0] ? ';' : ' ');
        }
    }
    return at == end;
}

void read_bed(Section& s, printer::KeptBed& bed) {
    s.text("name", bed.name);
    bed.in_force = bed.name.view() == printer::kDefaultBed;  // of a file that does not say
    s.flag("in_force", bed.in_force);
    read_grid(s, bed.minimum, bed.maximum, bed.points);
    std::string heights;
    s.text("heights_mm", heights);
    const bool spans = bed.minimum[0] < bed.maximum[0] && bed.minimum[1] < bed.maximum[1];
    if (!spans || !read_heights(heights, bed))
        s.fault("heights_mm", "'heights_mm' does not have a height for each point of the grid");
}

/// What tuning and measuring may find (M500), and nothing else of a machine.
void read_kept(Section& s, MachineConfig& m) {
    const auto read = [](Section& heater, HeaterConfig& config) {
        read_gains(heater, config);
        heater.table("model", [&](Section& model) { read_model(model, config.model); });
    };
    s.table("hot_end", [&](Section& heater) { read(heater, m.hot_end); });
    s.table("bed", [&](Section& heater) { read(heater, m.bed); });
    std::vector<printer::KeptBed> beds;
    s.tables("beds", beds, {"name", "heights_mm"},
             [](Section& bed, printer::KeptBed& to) { read_bed(bed, to); });
    for (const printer::KeptBed& bed : beds)
        if (!m.beds.try_push_back(bed))
            return s.fault("beds", "there are more than the printer has room for");
}

}  // namespace

std::string machine_error(std::string_view text, std::string_view name, MachineConfig& machine,
                          const ReadMore& read_more) {
    std::string error = read_toml(text, name, [&](Section& root) {
        read_machine(root, machine);
        if (read_more) read_more(root);
    });
    if (!error.empty()) return error;
    const auto broken = broken_rule(machine);
    return broken ? place_in_toml(text, name, broken->path) + broken->what : error;
}

Result<MachineConfig> parse_machine(std::string_view text, std::string_view name, const ReadMore& read_more) {
    MachineConfig machine;
    const std::string error = machine_error(text, name, machine, read_more);
    if (!error.empty()) return toml_error(error);
    return machine;
}

Result<MachineConfig> read_machine_file(const std::filesystem::path& path, const ReadMore& read_more) {
    if (path.empty()) return MachineConfig{};
    const Result<std::string> read = posix::read_small_file(path);
    if (read) return parse_machine(*read, path.filename().string(), read_more);
    return make_error(ErrorCode::not_found, "machine file ", path.native(),
                      " cannot be read: check its path");
}

// ---- what M500 keeps ----------------------------------------------------------------------------

namespace {

void write_heater(std::string& out, std::string_view table, const printer::HeaterSettings& heater) {
    const printer::HeaterModel& model = heater.model;
    write(out, '[', table, "]\nkp = ", Shortest{heater.kp}, "\nki = ", Shortest{heater.ki},
          "\nkd = ", Shortest{heater.kd}, "\n[", table, ".model]\npower_w = ", Shortest{model.power_w},
          "\nheat_capacity_j_k = ", Shortest{model.heat_capacity_j_k},
          "\nloss_w_k = ", Shortest{model.loss_w_k}, "\nfan_loss_w_k = ", Shortest{model.fan_loss_w_k},
          "\nsensor_lag_s = ", Shortest{model.sensor_lag_s},
          "\nfilament_j_mm3_k = ", Shortest{model.filament_j_mm3_k}, '\n');
}

void write_bed(std::string& out, const printer::KeptBed& bed) {
    write(out, "[[beds]]\nname = \"", bed.name.view(),
          "\"\nin_force = ", bed.in_force ? "true\n" : "false\n");
    for (std::size_t i = 0; i < 2; ++i) {
        write(out, kGridKeys[i][0], " = ", Shortest{bed.minimum[i].value()}, '\n', kGridKeys[i][1], " = ",
              Shortest{bed.maximum[i].value()}, '\n', kGridKeys[i][2], " = ", bed.points[i], '\n');
    }
    std::string_view between = "heights_mm = \"";
    for (std::size_t row = 0; row < bed.points[1]; ++row) {
        for (std::size_t column = 0; column < bed.points[0]; ++column, between = " ")
            write(out, between, Shortest{bed.heights[row][column]});
        between = "; ";
    }
    write(out, "\"\n");
}

}  // namespace

std::string kept_text(const printer::HeaterSettings& hot_end, const printer::HeaterSettings& bed,
                      const printer::KeptBeds& beds) {
    std::string out =
        "# Kept by M500: they go before the machine file. Without this file that counts again.\n";
    write_heater(out, "hot_end", hot_end);
    write_heater(out, "bed", bed);
    for (const printer::KeptBed& each : beds) write_bed(out, each);
    return out;
}

Result<void> apply_kept(std::string_view text, std::string_view name, MachineConfig& machine) {
    MachineConfig changed = machine;
    for (HeaterConfig* heater : {&changed.hot_end, &changed.bed})
        heater->factory = printer::factory_settings_of(*heater);
    const std::string error = read_toml(text, name, [&](Section& root) { read_kept(root, changed); });
    if (!error.empty()) return toml_error(error, " (remove the file: the machine file counts)");
    machine = changed;
    return {};
}

Result<MachineConfig> read_machine_files(const std::filesystem::path& path,
                                         const std::filesystem::path& kept) {
    QDUINO_TRY_ASSIGN(MachineConfig machine, read_machine_file(path));
    const Result<std::string> text = kept.empty() ? std::string{} : posix::read_small_file(kept);
    if (text) {
        QDUINO_TRY(apply_kept(*text, kept.native(), machine));
    }
    return machine;
}

}  // namespace qduino::apps
