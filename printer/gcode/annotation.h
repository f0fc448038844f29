// What a slicer's comments say about the moves that follow: layer, kind of path, width, height.
//
// Facts, from files of the slicers themselves: PrusaSlicer and its kin write `;LAYER_CHANGE`,
// `;Z:0.2`, `;HEIGHT:0.2`, `;TYPE:External perimeter`, `;WIDTH:0.45`; Cura and ideaMaker
// `;LAYER:0`, `;TYPE:WALL-OUTER`; Bambu Studio `; CHANGE_LAYER`, `; FEATURE: Outer wall`;
// Simplify3D `; layer 1, Z = 0.48`, `; feature outer perimeter`; FlashPrint `;layer:0.19`,
// `;structure:shell-outer`; KISSlicer `; BEGIN_LAYER_OBJECT z=0.25 …`, `; 'Perimeter Path', …`.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace qduino::printer::gcode {

/// Numbers are part of the packed layer format (preflight/layer_packer.h): append only.
enum class Feature : std::uint8_t {
    unknown = 0,
    outer_wall = 1,
    inner_wall = 2,
    overhang = 3,
    sparse_infill = 4,
    solid_infill = 5,
    top_surface = 6,
    bridge = 7,
    gap_fill = 8,
    skirt = 9,  ///< and brim
    support = 10,
    support_interface = 11,
    prime_tower = 12,
    ironing = 13,
    custom = 14,  ///< the user's own start and end code
};
inline constexpr std::size_t kFeatureCount = 15;

/// By either slicer's name (`External perimeter`, `WALL-OUTER`); unknown when it is none of them.
Feature feature_from_name(std::string_view name);

enum class AnnotationKind : std::uint8_t { none, layer_change, layer_number, feature, z, height, width };

struct Annotation {
    AnnotationKind kind = AnnotationKind::none;
    double value = 0;  ///< layer number (from 0), or millimetres
    Feature feature = Feature::unknown;
};

/// `comment`: the text behind the `;`. The result has no kind when it is none of the above.
Annotation parse_annotation(std::string_view comment);

/// Counts layers by comments, for a file that uses either slicer's way, or both at once.
class LayerCounter {
  public:
    /// True when the comment began a new layer.
    bool on_annotation(const Annotation& annotation);
    /// Layers begun; 0 before the first, or when the file has no such comments.
    [[nodiscard]] std::uint32_t layers() const { return layers_; }

  private:
    std::uint32_t layers_ = 0;
    bool by_change_ = false;  ///< `;LAYER_CHANGE` has been seen: `;LAYER:n` then says nothing new
};

}  // namespace qduino::printer::gcode
