// Which layer a move belongs to. The slicer's comments say it; without comments, Z does.
//
// With comments, a layer begins at `;LAYER_CHANGE` or `;LAYER:n`, whatever Z does (a spiral vase
// rises all the time). An extrusion before the first comment (a priming line) belongs to the first
// layer. Without comments (Slic3r), a layer begins with the first extrusion whose Z differs from
// that of its layer by at least kImplicitStepMm. A spiral then falls into slices of that height,
// and not into one layer for each of its segments.
//
// A job has kLayersMax layers at most, so that a file of nothing but comments fills no memory. What
// follows belongs to the last one.
#pragma once

#include "printer/gcode/actions.h"
#include "printer/gcode/annotation.h"
#include "printer/preflight/move_sink.h"

namespace qduino::printer::preflight {

class LayerTracker {
  public:
    static constexpr double kImplicitStepMm = 0.04;
    /// 65 cm of layers of kImplicitStepMm.
    static constexpr std::uint32_t kLayersMax = 16'384;

    void on_annotation(const gcode::Annotation& annotation, const gcode::Source& source);
    /// The context of `move`, up to date with it.
    const MoveContext& on_move(const gcode::Move& move);

    /// Layers with an extrusion in them.
    [[nodiscard]] std::uint32_t layers() const { return layers_; }
    [[nodiscard]] const Layer& layer() const { return context_.layer; }

  private:
    void begin(double z_mm, std::uint64_t first_byte);

    MoveContext context_;
    gcode::LayerCounter comments_;
    std::uint32_t layers_ = 0;
    std::uint64_t change_offset_ = 0;
    bool change_pending_ = false;  ///< a comment has begun a layer that has no extrusion yet
    bool by_comment_ = false;      ///< the current layer was begun by one
    double commented_height_mm_ = 0;
};

}  // namespace qduino::printer::preflight
