#include "printer/facts/facts_json.h"

#include <utility>

namespace qduino::printer {

using Json = nlohmann::ordered_json;
using estimate::Estimate;
using preflight::Facts;
using preflight::Finding;

namespace {

template <typename Positions>
Json xyz(const Positions& positions) {
    return {positions[0].value(), positions[1].value(), positions[2].value()};
}

/// {"outer_wall": 123.4, …}: what takes any time.
Json activities_json(const Estimate& estimate) {
    Json activities = Json::object();
    for (std::size_t i = 0; i < estimate.activity_s.size(); ++i) {
        const auto activity = static_cast<estimate::Activity>(i);
        if (const double time_s = tenths(estimate.activity_s[i]); time_s > 0)
            activities[std::string{name_of(activity)}] = time_s;
    }
    return activities;
}

/// What web/api/eta.h reads.
Json profile_json(const Estimate& estimate) {
    Json bytes = Json::array();
    for (const std::uint64_t byte : estimate.profile.bytes()) bytes.push_back(byte);
    return {{"step_s", estimate.profile.step_s()},
            {"bytes", std::move(bytes)},
            {"heating_s", tenths(estimate.heating_s())},
            {"heated_byte", estimate.heated_byte}};
}

}  // namespace

std::string sentence_of(const Finding& finding) {
    std::string text{finding.message.view()};
    if (finding.advice.empty()) return text;
    if (!text.empty() && text.back() != '.') text += '.';
    return text.append(" ").append(finding.advice.view());
}

Json facts_json(const Facts& facts, const Estimate& estimate) {
    Json warnings = Json::array();
    for (const Finding& warning : facts.warnings) {
        warnings.push_back({{"line", warning.line}, {"message", sentence_of(warning)}});
    }
    const auto& metadata = facts.metadata;
    return {{"estimated_s", tenths(estimate.total_s)},
            {"activities_s", activities_json(estimate)},
            {"profile", profile_json(estimate)},
            {"slicer_s", metadata.estimated ? Json(metadata.estimated->value()) : Json{}},
            {"filament_mm", facts.filament.value()},
            {"layers", facts.layers},
            {"layer_height_mm", facts.layer_height.value()},
            {"min_mm", xyz(facts.extruding_bounds.minimum)},
            {"max_mm", xyz(facts.extruding_bounds.maximum)},
            {"hot_end_c", facts.hot_end_maximum.value()},
            {"bed_c", facts.bed_maximum.value()},
            {"lines", facts.lines},
            {"moves", facts.moves},
            {"slicer", std::string{metadata.slicer.view()}},
            {"material", std::string{metadata.material.view()}},
            {"thumbnail", !facts.thumbnail.png.empty()},
            {"warnings", std::move(warnings)},
            {"warnings_count", facts.warnings_count}};
}

}  // namespace qduino::printer
