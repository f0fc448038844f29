#include "printer/preflight/layer_tracker.h"

#include <cmath>

namespace qduino::printer::preflight {

void LayerTracker::on_annotation(const gcode::Annotation& annotation, const gcode::Source& source) {
    switch (annotation.kind) {
        case gcode::AnnotationKind::feature:
            context_.feature = annotation.feature;
            return;
        case gcode::AnnotationKind::width:
            context_.width_mm = annotation.value;
            return;
        case gcode::AnnotationKind::height:
            commented_height_mm_ = annotation.value;
            return;
        case gcode::AnnotationKind::z:
            return;
        case gcode::AnnotationKind::layer_change:
        case gcode::AnnotationKind::layer_number:
            break;
        case gcode::AnnotationKind::none:
            return;
    }
    if (!comments_.on_annotation(annotation) || change_pending_) return;
    change_pending_ = true;
    change_offset_ = source.offset;
}

const MoveContext& LayerTracker::on_move(const gcode::Move& move) {
    context_.extrudes = move.kind == gcode::MoveKind::print && move.to[Axis::e] > move.from[Axis::e];
    if (!context_.extrudes) return context_;
    const double z_mm = move.to[Axis::z].value();
    const bool first_comment_after_priming = change_pending_ && layers_ == 1 && !by_comment_;
    if (first_comment_after_priming) {
        context_.layer.z_mm = context_.layer.height_mm = z_mm;
        if (commented_height_mm_ > 0) context_.layer.height_mm = commented_height_mm_;
        by_comment_ = true;
    } else if (layers_ == 0) {
        begin(z_mm, 0);
    } else if (change_pending_) {
        begin(z_mm, change_offset_);
    } else if (comments_.layers() == 0 && std::abs(z_mm - context_.layer.z_mm) >= kImplicitStepMm) {
        begin(z_mm, move.source.offset);
    }
    change_pending_ = false;
    return context_;
}

void LayerTracker::begin(double z_mm, std::uint64_t first_byte) {
    z_below_mm_ = layers_ == 0 ? 0 : context_.layer.z_mm;
    const double risen_mm = z_mm - z_below_mm_;
    context_.layer.index = layers_++;
    context_.layer.z_mm = z_mm;
    context_.layer.height_mm =
        commented_height_mm_ > 0 ? commented_height_mm_ : (risen_mm > 0 ? risen_mm : 0);
    context_.layer.first_byte = first_byte;
    by_comment_ = change_pending_;
}

}  // namespace qduino::printer::preflight
