#include "printer/gcode/layer_finder.h"

#include <cmath>

namespace qduino::printer::gcode {

LayerFinder::Found LayerFinder::found(double z_mm) const {
    if (change_pending_ && layers_ == 1 && !by_comment_) return Found::named;
    if (layers_ == 0) return Found::first;
    if (layers_ == kLayersMax) return Found::same;
    if (change_pending_) return Found::commented;
    const bool risen = comments_.layers() == 0 && std::abs(z_mm - z_mm_) >= kImplicitStepMm;
    return risen ? Found::risen : Found::same;
}

LayerFinder::Found LayerFinder::on_extrusion(double z_mm) {
    const Found result = found(z_mm);
    const bool begins = result != Found::same && result != Found::named;
    if (begins) ++layers_;
    if (result != Found::same) {
        z_mm_ = z_mm;
        by_comment_ = change_pending_;
    }
    by_comment_ = by_comment_ || change_pending_;
    change_pending_ = false;
    return result;
}

}  // namespace qduino::printer::gcode
