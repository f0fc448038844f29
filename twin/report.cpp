#include "twin/report.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/text.h"
#include "twin/advance_watch.h"

namespace qduino::twin {
namespace {

using Json = nlohmann::ordered_json;

/// Adds a difference that consists of `pieces`, as base/text.h takes them.
template <typename... Pieces>
void differ(Report& report, const Pieces&... pieces) {
    report.differences.push_back(text<std::string>(pieces...));
}

void judge_deviation(Report& report, std::size_t axis, std::string_view from, double deviation_mm,
                     double allowed_mm, std::uint64_t line) {
    if (deviation_mm <= allowed_mm) return;
    differ(report, kAxisLetter[axis], " left the asked ", from, " by ", Fixed{deviation_mm, 6},
           " mm (at most ", Fixed{allowed_mm, 6}, ") near line ", line);
}

void judge_axis(Report& report, std::size_t axis, const Tolerances& tolerances) {
    const AxisFindings& found = report.findings.axes[axis];
    const char letter = kAxisLetter[axis];
    judge_deviation(report, axis, "path", found.path_deviation_mm_max,
                    tolerances.path_mm[axis] + found.reach_mm, found.worst_line);
    judge_deviation(report, axis, "curve", found.curve_deviation_mm_max,
                    tolerances.curve_mm[axis] + found.reach_mm, found.worst_curve_line);
    if (!found.final_exact)
        differ(report, letter, " ended at ", Fixed{found.final_built_mm, 6}, " mm where ",
               Fixed{found.final_asked_mm, 6}, " was asked");
    if (report.lost_steps[axis] != 0) differ(report, letter, " lost ", report.lost_steps[axis], " steps");
}

void judge_advance(Report& report) {
    const Findings& found = report.findings;
    if (found.advance_stretches < AdvanceWatch::kStretchesMin) return;
    if (std::abs(found.advance_gain - 1) <= Tolerances::kAdvanceShare) return;
    differ(report, "the filament was pushed ahead of the motion by ", Fixed{found.advance_gain, 3},
           " of what pressure advance asks for (within ", Fixed{Tolerances::kAdvanceShare, 2}, ")");
}

void judge_excursions(Report& report) {
    const Findings& found = report.findings;
    if (found.excursions > report.excursions_told)
        differ(report, "the head left the asked path at a rest and came back ", found.excursions,
               " times; the machine tells of ", report.excursions_told);
    if (!found.away) return;
    std::string where;
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
        const std::int64_t beside = found.beside_steps[axis];
        write(where, axis == 0 ? " to the step: " : ", ", kAxisLetter[axis], beside < 0 ? " " : " +", beside);
    }
    const bool near = found.beside_steps != decltype(found.beside_steps){};
    differ(report, "the head left the asked path near line ", found.left_line, " and did not come back",
           near ? where : "");
}

void judge_racking(Report& report) {
    for (std::size_t which = 0; which < report.racking.size(); ++which) {
        const Racking& found = report.racking[which];
        const char letter = kAxisLetter[found.slide()];
        if (found.worst() > Tolerances::kRackingSteps)
            differ(report, "extra motor ", which + 1, " of the machine went ", found.worst(),
                   " steps beside the first motor of ", letter);
        if (found.off_switch() > Tolerances::kOffSwitchSteps)
            differ(report, "extra motor ", which + 1, " of the machine was homed ", found.off_switch(),
                   " steps beside the switch of its end of ", letter);
    }
}

/// `value_of(axis)` of each axis.
template <typename ValueOf>
Json by_axis(ValueOf&& value_of) {
    Json json;
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
        json[std::string(1, static_cast<char>(kAxisLetter[axis] | 0x20))] = value_of(axis);
    return json;
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

Tolerances tolerances_of(const Machine& machine, const Findings& found) {
    Tolerances allowed;
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
        const double step_mm = 1 / machine.axes[axis].steps_per_mm;
        const bool belt = machine.gantry == GantryType::corexy && axis < 2;
        const double steps = Tolerances::kHalfStep + (belt ? Tolerances::kBeltSteps : 0);
        const double lag_mm = steps * step_mm + found.axes[axis].turn_mm;
        allowed.path_mm[axis] = std::max(Tolerances::kSlideSteps * step_mm, lag_mm);
        allowed.curve_mm[axis] = std::max(Tolerances::kCurveSteps * step_mm, lag_mm) + Tolerances::kCurveMm;
    }
    const double step_mm = 1 / machine.axes[kExtruder].steps_per_mm;
    allowed.path_mm[kExtruder] = allowed.curve_mm[kExtruder] =
        std::max(Tolerances::kExtruderSteps * step_mm, Tolerances::kExtruderMm);
    return allowed;
}

void judge(Report& report, const Machine& machine) {
    const Tolerances tolerances = tolerances_of(machine, report.findings);
    report.differences.clear();
    report.completed = report.findings.path_consumed;
    if (!report.completed)
        differ(report, "the asked path was not built to its end: line ", report.findings.line,
               " was reached");
    judge_excursions(report);
    judge_advance(report);
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) judge_axis(report, axis, tolerances);
    judge_racking(report);
    const double asked = report.findings.filament_asked_mm;
    const double built = report.findings.filament_built_mm;
    // Half a microstep at either end of the job is rounding.
    const double allowed = std::max(tolerances.filament_share * std::abs(asked),
                                    (1.0 + 1e-9) / machine.axes[kExtruder].steps_per_mm);
    if (std::abs(built - asked) > allowed)
        differ(report, Fixed{built, 4}, " mm of filament were pushed where ", Fixed{asked, 4},
               " were asked (within ", Fixed{allowed, 4}, ")");
    report.matches = report.differences.empty();
}

std::string to_json(const Report& report, std::size_t layer_limit) {
    const Findings& found = report.findings;
    const auto of_axes = [&](auto AxisFindings::*field) {
        return by_axis([&](std::size_t axis) { return found.axes[axis].*field; });
    };
    const auto counted = [&](std::uint64_t AxisCounters::*field) {
        return by_axis([&](std::size_t axis) { return report.counters[axis].*field; });
    };
    Json json;
    json["completed"] = report.completed;
    json["matches"] = report.matches;
    json["differences"] = report.differences;
    json["line"] = found.line;
    json["excursions"] = {{"seen", found.excursions}, {"told", report.excursions_told}};
    json["duration_s"] = report.duration_s;
    json["steps"] = of_axes(&AxisFindings::steps);
    json["lost_steps"] = by_axis([&](std::size_t axis) { return report.lost_steps[axis]; });
    json["lost_by"] = {{"pull_out", counted(&AxisCounters::lost_pull_out)},
                       {"hard_stop", counted(&AxisCounters::lost_hard_stop)},
                       {"timing", counted(&AxisCounters::lost_timing)},
                       {"disabled", counted(&AxisCounters::ignored_disabled)}};
    json["timing_violations"] = report.timing_violations;
    json["unexplained_steps"] = of_axes(&AxisFindings::unexplained);
    json["path_deviation_mm_max"] = of_axes(&AxisFindings::path_deviation_mm_max);
    json["path_deviation_line"] = of_axes(&AxisFindings::worst_line);
    json["curve_deviation_mm_max"] = of_axes(&AxisFindings::curve_deviation_mm_max);
    json["curve_deviation_line"] = of_axes(&AxisFindings::worst_curve_line);
    json["final_position_mm"] = {{"asked", of_axes(&AxisFindings::final_asked_mm)},
                                 {"built", of_axes(&AxisFindings::final_built_mm)}};
    json["filter_reach_mm"] = of_axes(&AxisFindings::reach_mm);
    json["advance"] = {{"gain", found.advance_gain}, {"stretches", found.advance_stretches}};
    json["homed"] = of_axes(&AxisFindings::homed);
    json["homing_error_mm"] = of_axes(&AxisFindings::homing_error_mm);
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
