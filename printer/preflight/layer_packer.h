// A job's extrusions as binary layers, which the page draws as they are, without parsing.
//
// FORMAT, version 1. Everything is little-endian. A layer is one record (a layer of more than
// kVerticesMax vertices is several, with the same `layer` and rising `part`). Records may be joined
// end to end: a reader goes from header to header by vertex_count. A field of four bytes stands
// at a multiple of four from the beginning of the record.
//
//   record  :=  header (40 bytes)  vertex (20 bytes) × vertex_count
//
//   header   offset  type     field
//              0     u32      magic          0x314C4451, the bytes "QDL1"
//              4     u32      layer          from 0
//              8     u32      part           0, unless the layer was divided
//             12     f32      z_mm           of the layer's first extrusion
//             16     f32      height_mm      of the layer; 0: not known
//             20     u32      vertex_count
//             24     u32      segment_count  vertices that are not the start of a polyline
//             28     u32      reserved       0
//             32     f64      first_byte     of the layer, in the job's file (exact: < 2^53)
//
//   vertex   offset  type     field
//              0     f32      x_mm           in machine coordinates
//              4     f32      y_mm
//              8     f32      z_mm
//             12     u8       feature        gcode::Feature (annotation.h) of the segment that ends
//             13     u8       flags          bit 0: a polyline starts here, no segment ends here
//             14     u16      width_um       of that segment's extrusion, micrometres; 0: not known
//             16     u32      byte           of the line that drew it, from first_byte; the segment
//                                            is laid down once bytes_executed > first_byte + byte
//
//     start ──────● segment 1 ──────● segment 2          start ─────● segment 3
//     flags 1      flags 0           flags 0             flags 1     flags 0
//
// The page draws a segment between every vertex with flag 0 and the vertex before it. Travel
// between polylines is not packed. In JavaScript a record that begins at a multiple of 4 may be
// seen as Float32Array and Uint32Array over the same buffer: 10 words of header, then 5 words a
// vertex; `first_byte` by DataView.getFloat64(32, true).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "printer/preflight/move_sink.h"

namespace qduino::printer::preflight {

inline constexpr std::uint32_t kLayerMagic = 0x314C4451;
inline constexpr std::size_t kLayerHeaderBytes = 40;
inline constexpr std::size_t kVertexBytes = 20;
inline constexpr std::uint8_t kVertexStartsPolyline = 1;
/// Vertices of one record: 2.6 MB at most.
inline constexpr std::size_t kVerticesMax = std::size_t{1} << 17;

struct LayerRecord {
    Layer layer;
    std::uint32_t part = 0;
    std::uint32_t vertices = 0;
    std::uint32_t segments = 0;
    std::uint64_t last_byte = 0;  ///< offset of the last line in it
};

class LayerSink {
  public:
    virtual ~LayerSink() = default;
    /// `bytes` is one record, header included, valid during the call.
    virtual void on_layer(const LayerRecord& record, std::span<const std::uint8_t> bytes) = 0;
};

/// Holds one record at a time, and allocates once.
class LayerPacker final : public MoveSink {
  public:
    /// `filament_diameter_mm` gives the width where no comment does. `sink` must outlive the
    /// packer.
    LayerPacker(double filament_diameter_mm, LayerSink& sink);

    void on_move(const gcode::Move& move, const MoveContext& context) override;
    /// Delivers the last layer.
    void on_end(std::uint64_t /*bytes*/) override {
        if (open_) flush();
    }

  private:
    void flush();
    void open(const MoveContext& context);
    void add_vertex(const gcode::Position& at, gcode::Feature feature, double width_mm, std::uint64_t byte,
                    bool start);
    [[nodiscard]] double width_of(const gcode::Move& move, const MoveContext& context) const;

    LayerSink& sink_;
    double filament_area_mm2_;
    std::vector<std::uint8_t> bytes_;
    LayerRecord record_;
    bool open_ = false;
    gcode::Position last_{};  ///< end of the last segment packed
};

}  // namespace qduino::printer::preflight
