#include "printer/gcode/annotation.h"

#include <algorithm>
#include <utility>

#include "printer/gcode/text.h"

namespace qduino::printer::gcode {
namespace {

/// As PrusaSlicer, its kin (SuperSlicer, OrcaSlicer, Bambu Studio) and Cura spell them.
constexpr std::pair<std::string_view, Feature> kFeatureNames[]{
    {"External perimeter", Feature::outer_wall},
    {"Perimeter", Feature::inner_wall},
    {"Overhang perimeter", Feature::overhang},
    {"Internal infill", Feature::sparse_infill},
    {"Solid infill", Feature::solid_infill},
    {"Top solid infill", Feature::top_surface},
    {"Bridge infill", Feature::bridge},
    {"Internal bridge infill", Feature::bridge},
    {"Gap fill", Feature::gap_fill},
    {"Thin wall", Feature::outer_wall},
    {"Skirt", Feature::skirt},
    {"Skirt/Brim", Feature::skirt},
    {"Support material", Feature::support},
    {"Support material interface", Feature::support_interface},
    {"Wipe tower", Feature::prime_tower},
    {"Ironing", Feature::ironing},
    {"Custom", Feature::custom},
    {"Outer wall", Feature::outer_wall},
    {"Inner wall", Feature::inner_wall},
    {"Overhang wall", Feature::overhang},
    {"Sparse infill", Feature::sparse_infill},
    {"Internal solid infill", Feature::solid_infill},
    {"Bottom surface", Feature::solid_infill},
    {"Top surface", Feature::top_surface},
    {"Bridge", Feature::bridge},
    {"Internal Bridge", Feature::bridge},
    {"Gap infill", Feature::gap_fill},
    {"Brim", Feature::skirt},
    {"Support", Feature::support},
    {"Support interface", Feature::support_interface},
    {"Support transition", Feature::support_interface},
    {"Prime tower", Feature::prime_tower},
    {"WALL-OUTER", Feature::outer_wall},
    {"WALL-INNER", Feature::inner_wall},
    {"FILL", Feature::sparse_infill},
    {"SKIN", Feature::top_surface},
    {"SKIRT", Feature::skirt},
    {"SUPPORT", Feature::support},
    {"SUPPORT-INTERFACE", Feature::support_interface},
    {"PRIME-TOWER", Feature::prime_tower},
};

/// A comment that is a number from 0 to 1e6 and nothing else.
std::optional<double> whole_number(std::string_view text) {
    text = trim(text);
    const auto value = take_number(text);
    return value && text.empty() && *value >= 0 && *value <= 1e6 ? value : std::nullopt;
}

Annotation measured(AnnotationKind kind, std::string_view text) {
    const auto value = whole_number(text);
    return value ? Annotation{kind, *value, Feature::unknown} : Annotation{};
}

}  // namespace

Feature feature_from_name(std::string_view name) {
    const auto* known = std::ranges::find(kFeatureNames, name, [](const auto& row) { return row.first; });
    return known != std::end(kFeatureNames) ? known->second : Feature::unknown;
}

Annotation parse_annotation(std::string_view comment) {
    comment = trim(comment);
    // Nearly every annotation begins with one of these letters: other comments end here.
    if (comment.empty() || std::string_view{"LTZHW"}.find(comment.front()) == std::string_view::npos)
        return {};
    if (comment == "LAYER_CHANGE") return {AnnotationKind::layer_change, 0, Feature::unknown};
    if (skip_prefix(comment, "TYPE:")) return {AnnotationKind::feature, 0, feature_from_name(trim(comment))};
    if (skip_prefix(comment, "LAYER:")) return measured(AnnotationKind::layer_number, comment);
    if (skip_prefix(comment, "Z:")) return measured(AnnotationKind::z, comment);
    if (skip_prefix(comment, "HEIGHT:")) return measured(AnnotationKind::height, comment);
    if (skip_prefix(comment, "WIDTH:")) return measured(AnnotationKind::width, comment);
    return {};
}

bool LayerCounter::on_annotation(const Annotation& annotation) {
    const bool change = annotation.kind == AnnotationKind::layer_change;
    if (!change && (annotation.kind != AnnotationKind::layer_number || by_change_)) return false;
    by_change_ = change;
    ++layers_;
    return true;
}

}  // namespace qduino::printer::gcode
