// Which layer a move belongs to (gcode/layer_finder.h), with the layer's height and place in the
// file, and with what the comments say of the extrusion.
#pragma once

#include "printer/gcode/actions.h"
#include "printer/gcode/annotation.h"
#include "printer/gcode/layer_finder.h"
#include "printer/preflight/move_sink.h"

namespace qduino::printer::preflight {

class LayerTracker {
  public:
    void on_annotation(const gcode::Annotation& annotation, const gcode::Source& source);
    /// The context of `move`, up to date with it.
    const MoveContext& on_move(const gcode::Move& move);

    /// Layers with an extrusion in them.
    [[nodiscard]] std::uint32_t layers() const { return finder_.layers(); }
    [[nodiscard]] const Layer& layer() const { return context_.layer; }

  private:
    void begin(double z_mm, std::uint64_t first_byte);

    MoveContext context_;
    gcode::LayerFinder finder_;
    std::uint64_t change_offset_ = 0;  ///< of the comment that has begun a layer
    double commented_height_mm_ = 0;
};

}  // namespace qduino::printer::preflight
