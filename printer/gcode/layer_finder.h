// Which layer an extrusion belongs to. The slicer's comments say it; without comments, Z does.
//
// With comments, a layer begins at `;LAYER_CHANGE` or `;LAYER:n`, whatever Z does (a spiral vase
// rises all the time). An extrusion before the first comment (a priming line) belongs to the first
// layer. Without comments (Slic3r), a layer begins with the first extrusion whose Z differs from
// that of its layer by at least kImplicitStepMm. A spiral then falls into slices of that height,
// and not into one layer for each of its segments.
//
// A job is counted twice: before it is printed (preflight), and while it is (machine). Both use
// this, so "layer 12 of 99" means the same layer on both sides.
//
// A job has kLayersMax layers at most, so that a file of nothing but comments fills no memory. What
// follows belongs to the last one.
#pragma once

#include "printer/gcode/annotation.h"

namespace qduino::printer::gcode {

class LayerFinder {
  public:
    static constexpr double kImplicitStepMm = 0.04;
    /// 65 cm of layers of kImplicitStepMm.
    static constexpr std::uint32_t kLayersMax = 16'384;

    /// True: the comment begins a layer, which exists from its first extrusion on.
    bool on_annotation(const Annotation& annotation) {
        const bool begins = comments_.on_annotation(annotation) && !change_pending_;
        change_pending_ = change_pending_ || begins;
        return begins;
    }

    /// What an extrusion does to the layers.
    enum class Found : std::uint8_t {
        same,
        first,      ///< the first of all
        named,      ///< the layer of a priming line is the one that the first comment begins
        commented,  ///< one that a comment has begun
        risen,      ///< one that nothing but its Z tells
    };
    /// An extrusion has ended at `z_mm`, in the machine's coordinates.
    Found on_extrusion(double z_mm);

    /// Layers with an extrusion in them.
    [[nodiscard]] std::uint32_t layers() const { return layers_; }

  private:
    Found found(double z_mm) const;

    LayerCounter comments_;
    std::uint32_t layers_ = 0;
    bool change_pending_ = false;  ///< a comment has begun a layer that has no extrusion yet
    bool by_comment_ = false;      ///< the current layer was begun by one
    double z_mm_ = 0;              ///< of the current layer's first extrusion
};

}  // namespace qduino::printer::gcode
