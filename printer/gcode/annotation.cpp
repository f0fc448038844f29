#include "printer/gcode/annotation.h"

#include <algorithm>
#include <array>

#include "printer/gcode/text.h"

namespace qduino::printer::gcode {
namespace {

struct FeatureName {
    std::string_view name;
    Feature feature;
};

/// As PrusaSlicer, its kin (SuperSlicer, OrcaSlicer, Bambu Studio) and Cura spell them.
constexpr std::array kFeatureNames{
    FeatureName{"External perimeter", Feature::outer_wall},
    FeatureName{"Perimeter", Feature::inner_wall},
    FeatureName{"Overhang perimeter", Feature::overhang},
    FeatureName{"Internal infill", Feature::sparse_infill},
    FeatureName{"Solid infill", Feature::solid_infill},
    FeatureName{"Top solid infill", Feature::top_surface},
    FeatureName{"Bridge infill", Feature::bridge},
    FeatureName{"Internal bridge infill", Feature::bridge},
    FeatureName{"Gap fill", Feature::gap_fill},
    FeatureName{"Thin wall", Feature::outer_wall},
    FeatureName{"Skirt", Feature::skirt},
    FeatureName{"Skirt/Brim", Feature::skirt},
    FeatureName{"Support material", Feature::support},
    FeatureName{"Support material interface", Feature::support_interface},
    FeatureName{"Wipe tower", Feature::prime_tower},
    FeatureName{"Ironing", Feature::ironing},
    FeatureName{"Custom", Feature::custom},
    FeatureName{"Outer wall", Feature::outer_wall},
    FeatureName{"Inner wall", Feature::inner_wall},
    FeatureName{"Overhang wall", Feature::overhang},
    FeatureName{"Sparse infill", Feature::sparse_infill},
    FeatureName{"Internal solid infill", Feature::solid_infill},
    FeatureName{"Bottom surface", Feature::solid_infill},
    FeatureName{"Top surface", Feature::top_surface},
    FeatureName{"Bridge", Feature::bridge},
    FeatureName{"Internal Bridge", Feature::bridge},
    FeatureName{"Gap infill", Feature::gap_fill},
    FeatureName{"Brim", Feature::skirt},
    FeatureName{"Support", Feature::support},
    FeatureName{"Support interface", Feature::support_interface},
    FeatureName{"Support transition", Feature::support_interface},
    FeatureName{"Prime tower", Feature::prime_tower},
    FeatureName{"WALL-OUTER", Feature::outer_wall},
    FeatureName{"WALL-INNER", Feature::inner_wall},
    FeatureName{"FILL", Feature::sparse_infill},
    FeatureName{"SKIN", Feature::top_surface},
    FeatureName{"SKIRT", Feature::skirt},
    FeatureName{"SUPPORT", Feature::support},
    FeatureName{"SUPPORT-INTERFACE", Feature::support_interface},
    FeatureName{"PRIME-TOWER", Feature::prime_tower},
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
    const auto* known = std::ranges::find(kFeatureNames, name, &FeatureName::name);
    return known != kFeatureNames.end() ? known->feature : Feature::unknown;
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
