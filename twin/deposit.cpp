#include "twin/deposit.h"

#include <algorithm>
#include <cmath>

namespace qduino::twin {

double Layer::height_deviation_mm() const {
    if (stretches < 2) return 0.0;
    const double count = static_cast<double>(stretches);
    const double mean = height_sum_mm / count;
    return std::sqrt(std::max(height_square_sum_mm2 / count - mean * mean, 0.0));
}

Deposit::Deposit(const Machine& machine, std::int64_t extruder_position)
    : step_volume_mm3_(machine.step_volume_mm3()),
      line_width_mm_(machine.nozzle_diameter_mm),
      furthest_(extruder_position) {}

void Deposit::extruder_at(std::int64_t position, const std::array<double, kSlideCount>& nozzle_mm) {
    if (position <= furthest_) {
        laying_ = false;
        return;
    }
    furthest_ = position;
    if (layers_.empty() || std::abs(nozzle_mm[2] - layers_.back().z_mm) > kLayerPitchMm)
        begin_layer(nozzle_mm);
    Layer& layer = layers_.back();
    layer.volume_mm3 += step_volume_mm3_;
    volume_mm3_ += step_volume_mm3_;
    layer.minimum_x_mm = std::min(layer.minimum_x_mm, nozzle_mm[0]);
    layer.maximum_x_mm = std::max(layer.maximum_x_mm, nozzle_mm[0]);
    layer.minimum_y_mm = std::min(layer.minimum_y_mm, nozzle_mm[1]);
    layer.maximum_y_mm = std::max(layer.maximum_y_mm, nozzle_mm[1]);
    if (laying_) {
        const double length = std::hypot(nozzle_mm[0] - last_mm_[0], nozzle_mm[1] - last_mm_[1]);
        layer.length_mm += length;
        stretch_.length_mm += length;
        stretch_.volume_mm3 += step_volume_mm3_;
        if (stretch_.length_mm >= kStretchMm) end_stretch();
    }
    laying_ = true;
    last_mm_ = nozzle_mm;
}

void Deposit::begin_layer(const std::array<double, kSlideCount>& nozzle_mm) {
    finish();
    laying_ = false;
    if (layers_.size() == kLayerLimit) {
        ++merged_;
        layers_.back().z_mm = nozzle_mm[2];
        return;
    }
    layers_.push_back({.z_mm = nozzle_mm[2],
                       .minimum_x_mm = nozzle_mm[0],
                       .maximum_x_mm = nozzle_mm[0],
                       .minimum_y_mm = nozzle_mm[1],
                       .maximum_y_mm = nozzle_mm[1]});
}

void Deposit::end_stretch() {
    Layer& layer = layers_.back();
    const double height = stretch_.volume_mm3 / (line_width_mm_ * stretch_.length_mm);
    layer.height_minimum_mm = layer.stretches == 0 ? height : std::min(layer.height_minimum_mm, height);
    layer.height_maximum_mm = std::max(layer.height_maximum_mm, height);
    ++layer.stretches;
    layer.height_sum_mm += height;
    layer.height_square_sum_mm2 += height * height;
    stretch_ = {};
}

// A stretch of less than half the length would show one microstep more than the line.
void Deposit::finish() {
    if (!layers_.empty() && stretch_.length_mm >= kStretchMm / 2) end_stretch();
    stretch_ = {};
}

}  // namespace qduino::twin
