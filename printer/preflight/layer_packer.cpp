#include "printer/preflight/layer_packer.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace qduino::printer::preflight {
namespace {

template <typename Unsigned>
void store(std::uint8_t* to, Unsigned value) {
    for (std::size_t i = 0; i < sizeof value; ++i) to[i] = static_cast<std::uint8_t>(value >> (8 * i));
}

void store_float(std::uint8_t* to, double value) {
    store(to, std::bit_cast<std::uint32_t>(static_cast<float>(value)));
}

std::uint16_t micrometres(double mm) {
    return static_cast<std::uint16_t>(std::clamp(mm * 1000 + 0.5, 0.0, 65535.0));
}

bool same_place(const gcode::Position& a, const gcode::Position& b) {
    return a[Axis::x] == b[Axis::x] && a[Axis::y] == b[Axis::y] && a[Axis::z] == b[Axis::z];
}

}  // namespace

LayerPacker::LayerPacker(double filament_diameter_mm, LayerSink& sink)
    : sink_(sink), filament_area_mm2_(std::numbers::pi / 4 * filament_diameter_mm * filament_diameter_mm) {
    // Pages that are not used cost nothing.
    bytes_.reserve(kLayerHeaderBytes + kVertexBytes * kVerticesMax);
}

void LayerPacker::on_move(const gcode::Move& move, const MoveContext& context) {
    if (!context.extrudes) return;
    const bool full = record_.vertices + 2 > kVerticesMax;
    const bool new_layer = open_ && context.layer.index != record_.layer.index;
    if (open_ && (full || new_layer)) {
        const std::uint32_t part = new_layer ? 0 : record_.part + 1;
        flush();
        record_.part = part;
    }
    if (!open_) open(context);
    record_.layer = context.layer;  // a priming line's layer learns its Z from the first comment
    const std::uint64_t byte = move.source.offset;
    if (record_.vertices == 0 || !same_place(move.from, last_)) {
        add_vertex(move.from, context.feature, 0, byte, true);
    }
    add_vertex(move.to, context.feature, width_of(move, context), byte, false);
    last_ = move.to;
}

void LayerPacker::open(const MoveContext& context) {
    open_ = true;
    record_.layer = context.layer;
    record_.vertices = record_.segments = 0;
    bytes_.assign(kLayerHeaderBytes, 0);
}

void LayerPacker::flush() {
    std::uint8_t* const header = bytes_.data();
    store(header, kLayerMagic);
    store(header + 4, record_.layer.index);
    store(header + 8, record_.part);
    store_float(header + 12, record_.layer.z_mm);
    store_float(header + 16, record_.layer.height_mm);
    store(header + 20, record_.vertices);
    store(header + 24, record_.segments);
    store(header + 32, std::bit_cast<std::uint64_t>(static_cast<double>(record_.layer.first_byte)));
    sink_.on_layer(record_, bytes_);
    open_ = false;
}

void LayerPacker::add_vertex(const gcode::Position& at, gcode::Feature feature, double width_mm,
                             std::uint64_t byte, bool start) {
    const std::size_t end = bytes_.size();
    bytes_.resize(end + kVertexBytes);
    std::uint8_t* const vertex = bytes_.data() + end;
    store_float(vertex, at[Axis::x].value());
    store_float(vertex + 4, at[Axis::y].value());
    store_float(vertex + 8, at[Axis::z].value());
    vertex[12] = static_cast<std::uint8_t>(feature);
    vertex[13] = start ? kVertexStartsPolyline : 0;
    store(vertex + 14, micrometres(width_mm));
    const std::uint64_t behind = byte - record_.layer.first_byte;
    store(vertex + 16, static_cast<std::uint32_t>(std::min<std::uint64_t>(behind, ~std::uint32_t{0})));
    ++record_.vertices;
    if (!start) ++record_.segments;
    record_.last_byte = byte;
}

double LayerPacker::width_of(const gcode::Move& move, const MoveContext& context) const {
    if (context.width_mm > 0) return context.width_mm;
    if (context.layer.height_mm <= 0) return 0;
    const double x = (move.to[Axis::x] - move.from[Axis::x]).value();
    const double y = (move.to[Axis::y] - move.from[Axis::y]).value();
    const double length_mm = std::hypot(x, y);
    if (length_mm <= 0) return 0;
    // The filament pushed in is the plastic laid down: filament area × ΔE = width × height ×
    // length, taking the bead for a rectangle.
    const double pushed_mm = (move.to[Axis::e] - move.from[Axis::e]).value();
    return filament_area_mm2_ * pushed_mm / (context.layer.height_mm * length_mm);
}

}  // namespace qduino::printer::preflight
