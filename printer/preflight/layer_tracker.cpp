#include "printer/preflight/layer_tracker.h"

#include <algorithm>
#include <cmath>

namespace qduino::printer::preflight {

void LayerTracker::on_annotation(const gcode::Annotation& annotation, const gcode::Source& source) {
    using enum gcode::AnnotationKind;
    if (annotation.kind == feature) context_.feature = annotation.feature;
    if (annotation.kind == width) context_.width_mm = annotation.value;
    if (annotation.kind == height) commented_height_mm_ = annotation.value;
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
    } else if (layers_ == kLayersMax) {
        by_comment_ = by_comment_ || change_pending_;
    } else if (change_pending_) {
        begin(z_mm, change_offset_);
    } else if (comments_.layers() == 0 && std::abs(z_mm - context_.layer.z_mm) >= kImplicitStepMm) {
        begin(z_mm, move.source.offset);
    }
    change_pending_ = false;
    return context_;
}

void LayerTracker::begin(double z_mm, std::uint64_t first_byte) {
    const double risen_mm = z_mm - (layers_ == 0 ? 0 : context_.layer.z_mm);
    const double height_mm = commented_height_mm_ > 0 ? commented_height_mm_ : std::max(risen_mm, 0.0);
    context_.layer = {layers_++, z_mm, height_mm, first_byte};
    by_comment_ = change_pending_;
}

}  // namespace qduino::printer::preflight
