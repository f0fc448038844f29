// The report of printer-sim: see print_file.h.
#include "apps/printer_sim/print_file.h"

#include <algorithm>
#include <numeric>

#include "printer/machine_config.h"
#include "terminal/human.h"

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

Json activities_json(const printer::estimate::Estimate& estimate) {
    Json out = Json::object();
    for (std::size_t i = 0; i < estimate.activity_s.size(); ++i)
        out[std::string{name_of(static_cast<printer::estimate::Activity>(i))}] = estimate.activity_s[i];
    return out;
}

/// How far the estimate is off, in percent of what the print took.
double estimate_error_percent(const PrintResult& result) {
    return 100 * (result.estimate.total_s / std::max(result.print_time_s, 1e-9) - 1);
}

std::uint64_t total_lost(const twin::Report& built) {
    return std::accumulate(built.lost_steps.begin(), built.lost_steps.end(), std::uint64_t{0});
}

Json range_json(const twin::Report& built, const twin::TemperatureRange& range) {
    return {{"min", built.extruded ? Json(range.minimum_celsius) : Json(nullptr)},
            {"max", built.extruded ? Json(range.maximum_celsius) : Json(nullptr)}};
}

Json refusal_json(const std::optional<Refusal>& refusal) {
    if (!refusal) return nullptr;
    return {{"line", refusal->line}, {"text", refusal->text}, {"why", refusal->why}, {"cure", refusal->cure}};
}

/// What a person reads of a job that was not begun.
std::string summary_of(const Refusal& refusal) {
    std::string out{"Refused before anything was heated.\n"};
    if (refusal.line > 0) write(out, "  line ", refusal.line, "  ", refusal.text, '\n');
    return write(out, "  why       ", refusal.why, "\n  cure      ", refusal.cure, '\n');
}

}  // namespace

Json to_json(const PrintResult& result) {
    const twin::Report& built = result.built;
    const twin::Findings& found = built.findings;
    const auto by_axis = [&](auto finding) {
        return per_axis([&](std::size_t i) { return found.axes[i].*finding; });
    };
    Json out;
    out["completed"] = result.job_completed && built.completed;
    out["matches"] = result.success();
    out["refused"] = refusal_json(result.refusal);
    out["remarks"] = result.remarks;
    out["error"] = result.error.empty() ? Json(nullptr) : Json(result.error);
    out["print_time_s"] = result.print_time_s;
    out["estimated_s"] = result.estimate.total_s;
    out["estimate_open_s"] = {{"less", result.estimate.less_s}, {"more", result.estimate.more_s}};
    out["activities_s"] = activities_json(result.estimate);
    out["wall_s"] = result.wall_s;
    out["steps"] = by_axis(&twin::AxisFindings::steps);
    out["final_position_mm"] = by_axis(&twin::AxisFindings::final_built_mm);
    out["final_position_asked_mm"] = by_axis(&twin::AxisFindings::final_asked_mm);
    out["final_position_exact"] = by_axis(&twin::AxisFindings::final_exact);
    out["filament_mm"] = {{"asked", found.filament_asked_mm},
                          {"built", found.filament_built_mm},
                          {"asked_pushed", found.filament_asked_pushed_mm},
                          {"built_pushed", found.filament_built_pushed_mm}};
    out["path_deviation_mm_max"] = by_axis(&twin::AxisFindings::path_deviation_mm_max);
    out["curve_deviation_mm_max"] = by_axis(&twin::AxisFindings::curve_deviation_mm_max);
    out["unexplained_steps"] = by_axis(&twin::AxisFindings::unexplained);
    out["homing_error_mm"] = by_axis(&twin::AxisFindings::homing_error_mm);
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
    out["temperature_c"] = range_json(built, built.hot_end);
    out["bed_temperature_c"] = range_json(built, built.bed);
    out["layers"] = built.layers.size();
    out["volume_mm3"] = built.volume_mm3;
    if (result.observed) {
        const Observed& seen = *result.observed;
        out["layer_height"] = heights_json(seen.heights);
        out["peak_steps_s"] = per_axis([&](std::size_t i) { return seen.peak_steps_s[i]; });
        out["features"] = features_json(seen);
        out["rested_s"] = seen.rested_s;
    }
    if (result.board) out["board"] = to_json(*result.board);
    out["unknown_codes"] = result.unknown_codes;
    out["warnings"] = result.warnings;
    out["differences"] = built.differences;
    return out;
}

std::string summary(const PrintResult& result) {
    if (result.refusal) return summary_of(*result.refusal);
    const twin::Report& built = result.built;
    const auto& axes = built.findings.axes;
    const auto late = [&](double share) {
        const Histogram& lateness = result.motion.lateness_ns;
        const std::uint64_t ns = share < 1 ? lateness.quantile(share) : lateness.max();
        return human_duration(Nanoseconds{static_cast<std::int64_t>(ns)});
    };
    std::string out = text<std::string>(
        result.success() ? "Built is what was asked." : "NOT what was asked.", "\n  printed   ",
        Fixed{result.print_time_s, 0}, " s in ", Fixed{result.wall_s, 1}, " s of wall time, ",
        built.layers.size(), " layers\n  estimated ", Fixed{result.estimate.total_s, 1},
        " s before the print, ", Fixed{estimate_error_percent(result), 2}, " % off; ",
        Fixed{result.estimate.less_s, 1}, " less to ", Fixed{result.estimate.more_s, 1},
        " more by where the axes stand\n  filament  asked ", Fixed{built.findings.filament_asked_mm},
        " mm, built ", Fixed{built.findings.filament_built_mm}, " mm\n  deviation X ",
        Fixed{axes[0].path_deviation_mm_max, 4}, "  Y ", Fixed{axes[1].path_deviation_mm_max, 4}, "  Z ",
        Fixed{axes[2].path_deviation_mm_max, 5}, "  E ", Fixed{axes[3].path_deviation_mm_max, 4},
        " mm at most\n  steps     X ", axes[0].steps, "  Y ", axes[1].steps, "  Z ", axes[2].steps, "  E ",
        axes[3].steps, ", lost ", total_lost(built), "\n  lateness  p50 ", late(0.5), "  p99 ", late(0.99),
        "  max ", late(1), '\n');
    if (result.observed) out += summary(*result.observed);
    if (!result.error.empty()) out += "  error     " + result.error + "\n";
    for (const std::string& difference : built.differences) out += "  differs   " + difference + "\n";
    for (const std::string& answer : result.answers) out += "  answer    " + answer + "\n";
    for (const std::string& remark : result.remarks) out += "  remark    " + remark + "\n";
    for (const std::string& code : result.unknown_codes) out += "  unknown   " + code + "\n";
    if (result.board) out += table(*result.board);
    return out + result.chains;
}

}  // namespace qduino::apps
