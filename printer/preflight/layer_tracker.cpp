#include "printer/preflight/layer_tracker.h"

#include <algorithm>

namespace qduino::printer::preflight {

void LayerTracker::on_annotation(const gcode::Annotation& annotation, const gcode::Source& source) {
    using enum gcode::AnnotationKind;
    if (annotation.kind == feature) context_.feature = annotation.feature;
    if (annotation.kind == width) context_.width_mm = annotation.value;
    if (annotation.kind == height) commented_height_mm_ = annotation.value;
    if (finder_.on_annotation(annotation)) change_offset_ = source.offset;
}

const MoveContext& LayerTracker::on_move(const gcode::Move& move) {
    using enum gcode::LayerFinder::Found;
    context_.extrudes = move.kind == gcode::MoveKind::print && move.to[Axis::e] > move.from[Axis::e];
    if (!context_.extrudes) return context_;
    const double z_mm = move.to[Axis::z].value();
    switch (finder_.on_extrusion(z_mm)) {
        case same:
            break;
        case named:
            context_.layer.z_mm = context_.layer.height_mm = z_mm;
            if (commented_height_mm_ > 0) context_.layer.height_mm = commented_height_mm_;
            break;
        case first:
            begin(z_mm, 0);
            break;
        case commented:
            begin(z_mm, change_offset_);
            break;
        case risen:
            begin(z_mm, move.source.offset);
            break;
    }
    return context_;
}

/// The layer that the finder has just found.
void LayerTracker::begin(double z_mm, std::uint64_t first_byte) {
    const std::uint32_t index = finder_.layers() - 1;
    const double risen_mm = z_mm - (index == 0 ? 0 : context_.layer.z_mm);
    const double height_mm = commented_height_mm_ > 0 ? commented_height_mm_ : std::max(risen_mm, 0.0);
    context_.layer = {index, z_mm, height_mm, first_byte};
}

}  // namespace qduino::printer::preflight
