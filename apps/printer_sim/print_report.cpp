#include "apps/printer_sim/print_report.h"

#include <cstdio>

#include "apps/terminal/human.h"
#include "printer/machine_config.h"

namespace qduino::apps {
namespace {

using Json = nlohmann::ordered_json;

/// {"x": f(0), "y": f(1), …} over all axes.
template <typename F>
Json per_axis(F value) {
    static constexpr std::array<const char*, twin::kAxisCount> kNames{"x", "y", "z", "e"};
    Json out = Json::object();
    for (std::size_t i = 0; i < kNames.size(); ++i) out[kNames[i]] = value(i);
    return out;
}

std::uint64_t total_lost(const twin::Report& built) {
    std::uint64_t sum = 0;
    for (const std::uint64_t lost : built.lost_steps) sum += lost;
    return sum;
}

}  // namespace

Json to_json(const PrintResult& result) {
    const twin::Report& built = result.built;
    const twin::Findings& found = built.findings;
    const auto axis = [&](std::size_t i) -> const twin::AxisFindings& { return found.axes[i]; };
    Json out;
    out["completed"] = result.job_completed && built.completed;
    out["matches"] = result.success();
    out["error"] = result.error.empty() ? Json(nullptr) : Json(result.error);
    out["print_time_s"] = result.print_time_s;
    out["wall_s"] = result.wall_s;
    out["steps"] = per_axis([&](std::size_t i) { return axis(i).steps; });
    out["final_position_mm"] = per_axis([&](std::size_t i) { return axis(i).final_built_mm; });
    out["final_position_asked_mm"] = per_axis([&](std::size_t i) { return axis(i).final_asked_mm; });
    out["final_position_exact"] = per_axis([&](std::size_t i) { return axis(i).final_exact; });
    out["filament_mm"] = {{"asked", found.filament_asked_mm},
                          {"built", found.filament_built_mm},
                          {"asked_pushed", found.filament_asked_pushed_mm},
                          {"built_pushed", found.filament_built_pushed_mm}};
    out["path_deviation_mm_max"] = per_axis([&](std::size_t i) { return axis(i).path_deviation_mm_max; });
    out["unexplained_steps"] = per_axis([&](std::size_t i) { return axis(i).unexplained; });
    out["homing_error_mm"] = per_axis([&](std::size_t i) { return axis(i).homing_error_mm; });
    out["lost_steps"] = total_lost(built);
    out["lost_steps_per_axis"] = per_axis([&](std::size_t i) { return built.lost_steps[i]; });
    out["timing_violations"] = built.timing_violations;
    const Histogram& lateness = result.motion.lateness_ns;
    out["lateness_ns"] = {{"p50", lateness.quantile(0.5)},
                          {"p99", lateness.quantile(0.99)},
                          {"p9999", lateness.quantile(0.9999)},
                          {"max", lateness.max()}};
    out["late_steps"] = result.motion.late_steps;
    out["starved"] = result.motion.starved;
    const bool warm = built.extruded;
    out["temperature_c"] = {{"min", warm ? Json(built.hot_end.minimum_celsius) : Json(nullptr)},
                            {"max", warm ? Json(built.hot_end.maximum_celsius) : Json(nullptr)}};
    out["bed_temperature_c"] = {{"min", warm ? Json(built.bed.minimum_celsius) : Json(nullptr)},
                                {"max", warm ? Json(built.bed.maximum_celsius) : Json(nullptr)}};
    out["layers"] = built.layers.size();
    out["volume_mm3"] = built.volume_mm3;
    out["unknown_codes"] = result.unknown_codes;
    out["warnings"] = result.warnings;
    out["differences"] = built.differences;
    return out;
}

std::string summary(const PrintResult& result) {
    const twin::Report& built = result.built;
    const auto& axes = built.findings.axes;
    const auto late = [&](double share) {
        const Histogram& lateness = result.motion.lateness_ns;
        const std::uint64_t ns = share < 1 ? lateness.quantile(share) : lateness.max();
        return human_duration(Nanoseconds{static_cast<std::int64_t>(ns)});
    };
    char text[1200];
    std::snprintf(
        text, sizeof text,
        "%s\n"
        "  printed   %.0f s in %.1f s of wall time, %zu layers\n"
        "  filament  asked %.2f mm, built %.2f mm\n"
        "  deviation X %.4f  Y %.4f  Z %.5f  E %.4f mm at most\n"
        "  steps     X %llu  Y %llu  Z %llu  E %llu, lost %llu\n"
        "  lateness  p50 %s  p99 %s  max %s\n",
        result.success() ? "Built is what was asked." : "NOT what was asked.", result.print_time_s,
        result.wall_s, built.layers.size(), built.findings.filament_asked_mm,
        built.findings.filament_built_mm, axes[0].path_deviation_mm_max, axes[1].path_deviation_mm_max,
        axes[2].path_deviation_mm_max, axes[3].path_deviation_mm_max,
        static_cast<unsigned long long>(axes[0].steps), static_cast<unsigned long long>(axes[1].steps),
        static_cast<unsigned long long>(axes[2].steps), static_cast<unsigned long long>(axes[3].steps),
        static_cast<unsigned long long>(total_lost(built)), late(0.5).c_str(), late(0.99).c_str(),
        late(1).c_str());
    std::string out = text;
    if (!result.error.empty()) out += "  error     " + result.error + "\n";
    for (const std::string& difference : built.differences) out += "  differs   " + difference + "\n";
    for (const std::string& code : result.unknown_codes) out += "  unknown   " + code + "\n";
    return out;
}

}  // namespace qduino::apps
