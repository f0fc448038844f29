#include "twin/report.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace qduino::twin {
namespace {

using Json = nlohmann::ordered_json;

__attribute__((format(printf, 2, 3))) void differ(Report& report, const char* format, ...) {
    char text[256];
    std::va_list arguments;
    va_start(arguments, format);
    std::vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    report.differences.emplace_back(text);
}

void judge_axis(Report& report, std::size_t axis, double tolerance_mm) {
    const AxisFindings& found = report.findings.axes[axis];
    const char letter = kAxisLetter[axis];
    if (found.path_deviation_mm_max > tolerance_mm)
        differ(report, "%c left the asked path by %.6f mm (at most %.6f) near line %llu", letter,
               found.path_deviation_mm_max, tolerance_mm, static_cast<unsigned long long>(found.worst_line));
    if (!found.final_exact)
        differ(report, "%c ended at %.6f mm where %.6f was asked", letter, found.final_built_mm,
               found.final_asked_mm);
    if (report.lost_steps[axis] != 0)
        differ(report, "%c lost %llu steps", letter,
               static_cast<unsigned long long>(report.lost_steps[axis]));
}

void judge_excursions(Report& report) {
    const Findings& found = report.findings;
    if (found.excursions > report.excursions_told)
        differ(report,
               "the head left the asked path at a rest and came back %llu times; the machine tells of %llu",
               static_cast<unsigned long long>(found.excursions),
               static_cast<unsigned long long>(report.excursions_told));
    if (!found.away) return;
    const auto& beside = found.beside_steps;
    const bool near = beside != decltype(found.beside_steps){};
    if (near)
        differ(report,
               "the head left the asked path near line %llu and did not come back to the step: X %+lld, Y "
               "%+lld, Z %+lld",
               static_cast<unsigned long long>(found.left_line), static_cast<long long>(beside[0]),
               static_cast<long long>(beside[1]), static_cast<long long>(beside[2]));
    else
        differ(report, "the head left the asked path near line %llu and did not come back",
               static_cast<unsigned long long>(found.left_line));
}

template <typename Value>
Json by_axis(const std::array<Value, kAxisCount>& values) {
    Json json;
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
        json[std::string(1, static_cast<char>(kAxisLetter[axis] | 0x20))] = values[axis];
    return json;
}

template <typename Field>
auto gather(const Report& report, Field AxisFindings::*field) {
    std::array<Field, kAxisCount> values{};
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) values[axis] = report.findings.axes[axis].*field;
    return values;
}

template <typename Field>
auto gather(const Report& report, Field AxisCounters::*field) {
    std::array<Field, kAxisCount> values{};
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) values[axis] = report.counters[axis].*field;
    return values;
}

Json layers_json(const Report& report, std::size_t limit) {
    Json list = Json::array();
    for (const Layer& layer : report.layers) {
        if (list.size() == limit) break;
        list.push_back({{"z_mm", layer.z_mm},
                        {"volume_mm3", layer.volume_mm3},
                        {"length_mm", layer.length_mm},
                        {"x_mm", {layer.minimum_x_mm, layer.maximum_x_mm}},
                        {"y_mm", {layer.minimum_y_mm, layer.maximum_y_mm}},
                        {"height_mm",
                         {{"mean", layer.height_mean_mm()},
                          {"deviation", layer.height_deviation_mm()},
                          {"min", layer.height_minimum_mm},
                          {"max", layer.height_maximum_mm}}}});
    }
    return list;
}

Json range_json(bool known, const TemperatureRange& range) {
    if (!known) return nullptr;
    return {{"min", range.minimum_celsius}, {"max", range.maximum_celsius}};
}

}  // namespace

void judge(Report& report, const Tolerances& tolerances, double filament_steps_per_mm) {
    report.differences.clear();
    report.completed = report.findings.path_consumed;
    if (!report.completed)
        differ(report, "the asked path was not built to its end: line %llu was reached",
               static_cast<unsigned long long>(report.findings.line));
    judge_excursions(report);
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) judge_axis(report, axis, tolerances.path_mm[axis]);
    const double asked = report.findings.filament_asked_mm;
    const double built = report.findings.filament_built_mm;
    // Half a microstep at either end of the job is rounding.
    const double allowed =
        std::max(tolerances.filament_share * std::abs(asked), (1.0 + 1e-9) / filament_steps_per_mm);
    if (std::abs(built - asked) > allowed)
        differ(report, "%.4f mm of filament were pushed where %.4f were asked (within %.4f)", built, asked,
               allowed);
    report.matches = report.differences.empty();
}

std::string to_json(const Report& report, std::size_t layer_limit) {
    const Findings& found = report.findings;
    Json json;
    json["completed"] = report.completed;
    json["matches"] = report.matches;
    json["differences"] = report.differences;
    json["line"] = found.line;
    json["excursions"] = {{"seen", found.excursions}, {"told", report.excursions_told}};
    json["duration_s"] = report.duration_s;
    json["steps"] = by_axis(gather(report, &AxisFindings::steps));
    json["lost_steps"] = by_axis(report.lost_steps);
    json["lost_by"] = {{"pull_out", by_axis(gather(report, &AxisCounters::lost_pull_out))},
                       {"hard_stop", by_axis(gather(report, &AxisCounters::lost_hard_stop))},
                       {"timing", by_axis(gather(report, &AxisCounters::lost_timing))},
                       {"disabled", by_axis(gather(report, &AxisCounters::ignored_disabled))}};
    json["timing_violations"] = report.timing_violations;
    json["unexplained_steps"] = by_axis(gather(report, &AxisFindings::unexplained));
    json["path_deviation_mm_max"] = by_axis(gather(report, &AxisFindings::path_deviation_mm_max));
    json["path_deviation_line"] = by_axis(gather(report, &AxisFindings::worst_line));
    json["final_position_mm"] = {{"asked", by_axis(gather(report, &AxisFindings::final_asked_mm))},
                                 {"built", by_axis(gather(report, &AxisFindings::final_built_mm))}};
    json["homed"] = by_axis(gather(report, &AxisFindings::homed));
    json["homing_error_mm"] = by_axis(gather(report, &AxisFindings::homing_error_mm));
    json["filament_mm"] = {{"asked", found.filament_asked_mm},
                           {"built", found.filament_built_mm},
                           {"asked_pushed", found.filament_asked_pushed_mm},
                           {"built_pushed", found.filament_built_pushed_mm}};
    json["cold_extrusion_steps"] = report.cold_extrusion_steps;
    json["temperature_c"] = {{"hot_end", range_json(report.extruded, report.hot_end)},
                             {"bed", range_json(report.extruded, report.bed)}};
    json["volume_mm3"] = report.volume_mm3;
    json["layer_count"] = report.layers.size();
    json["layers_merged"] = report.layers_merged;
    json["layers"] = layers_json(report, layer_limit);
    return json.dump();
}

}  // namespace qduino::twin
