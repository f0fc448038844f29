#include "printer/gcode/annotation.h"

#include <algorithm>
#include <utility>

#include "printer/gcode/text.h"

namespace qduino::printer::gcode {
namespace {

/// As PrusaSlicer and its kin (SuperSlicer, OrcaSlicer, Bambu Studio), Cura, ideaMaker, Simplify3D,
/// FlashPrint and KISSlicer spell them.
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
    {"Floating vertical shell", Feature::solid_infill},
    {"SOLID-FILL", Feature::solid_infill},
    {"outer perimeter", Feature::outer_wall},
    {"inner perimeter", Feature::inner_wall},
    {"infill", Feature::sparse_infill},
    {"solid layer", Feature::solid_infill},
    {"gap fill", Feature::gap_fill},
    {"bridge", Feature::bridge},
    {"skirt", Feature::skirt},
    {"support", Feature::support},
    {"dense support", Feature::support_interface},
    {"prime pillar", Feature::prime_tower},
    {"ooze shield", Feature::prime_tower},
    {"shell-outer", Feature::outer_wall},
    {"shell-inner", Feature::inner_wall},
    {"infill-solid", Feature::solid_infill},
    {"infill-sparse", Feature::sparse_infill},
    {"pre-extrude", Feature::custom},
    {"Perimeter Path", Feature::outer_wall},
    {"Loop Path", Feature::inner_wall},
    {"Solid Path", Feature::solid_infill},
    {"Sparse Infill Path", Feature::sparse_infill},
    {"Stacked Sparse Infill Path", Feature::sparse_infill},
    {"Crown", Feature::gap_fill},
    {"Skirt Path", Feature::skirt},
    {"Raft", Feature::support},
    {"Support (may Stack) Path", Feature::support},
    {"Support Interface", Feature::support_interface},
    {"Prime Pillar Path", Feature::prime_tower},
};

/// What a comment begins with, and what the rest of it is.
struct Form {
    std::string_view prefix;
    AnnotationKind kind;
};
constexpr Form kForms[]{
    {"LAYER_CHANGE", AnnotationKind::layer_change},           // PrusaSlicer
    {"CHANGE_LAYER", AnnotationKind::layer_change},           // Bambu Studio
    {"BEGIN_LAYER_OBJECT z=", AnnotationKind::layer_change},  // KISSlicer
    {"layer:", AnnotationKind::layer_change},                 // FlashPrint; its height follows
    {"LAYER:", AnnotationKind::layer_number},                 // Cura
    {"TYPE:", AnnotationKind::feature},
    {"FEATURE:", AnnotationKind::feature},    // Bambu Studio
    {"feature ", AnnotationKind::feature},    // Simplify3D
    {"structure:", AnnotationKind::feature},  // FlashPrint
    {"Z:", AnnotationKind::z},
    {"Z_HEIGHT:", AnnotationKind::z},
    {"HEIGHT:", AnnotationKind::height},
    {"LAYER_HEIGHT:", AnnotationKind::height},
    {"WIDTH:", AnnotationKind::width},
    {"LINE_WIDTH:", AnnotationKind::width},
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

/// KISSlicer: `'Perimeter Path', 0.0 [feed mm/s], …`.
Annotation quoted_feature(std::string_view text) {
    const std::size_t end = text.find('\'');
    if (end == std::string_view::npos) return {};
    const Feature feature = feature_from_name(text.substr(0, end));
    return feature == Feature::unknown ? Annotation{} : Annotation{AnnotationKind::feature, 0, feature};
}

/// Simplify3D: `layer 1, Z = 0.480`.
Annotation numbered_layer(std::string_view text) {
    const bool counts = take_integer(text).has_value() && text.starts_with(',');
    return counts ? Annotation{AnnotationKind::layer_change, 0, Feature::unknown} : Annotation{};
}

}  // namespace

Feature feature_from_name(std::string_view name) {
    const auto* known = std::ranges::find(kFeatureNames, name, [](const auto& row) { return row.first; });
    return known != std::end(kFeatureNames) ? known->second : Feature::unknown;
}

Annotation parse_annotation(std::string_view comment) {
    comment = trim(comment);
    // Nearly every annotation begins with one of these letters: other comments end here.
    if (comment.empty() || std::string_view{"LTZHWCBFlfs'"}.find(comment.front()) == std::string_view::npos)
        return {};
    if (comment.front() == '\'') return quoted_feature(comment.substr(1));
    if (skip_prefix(comment, "layer ")) return numbered_layer(comment);
    for (const Form& form : kForms) {
        std::string_view rest = comment;
        if (!skip_prefix(rest, form.prefix)) continue;
        if (form.kind == AnnotationKind::feature) return {form.kind, 0, feature_from_name(trim(rest))};
        if (form.kind != AnnotationKind::layer_change) return measured(form.kind, rest);
        const bool alone = rest.empty() || !is_letter(form.prefix.back());
        return alone ? Annotation{form.kind, 0, Feature::unknown} : Annotation{};
    }
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
