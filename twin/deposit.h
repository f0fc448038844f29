// Deposit: the plastic that was laid down, in figures of bounded size.
//
// The paper's equations 2–3 (section IV): a line of the nozzle's width d, laid at head speed v
// while the nozzle gives plastic at speed γ, is H = (π/4) d γ / v high. With v = (b p)/(s α) f that
// is H = K/f, K = (π/4)(s α d/(b p)) γ, and a pulse that comes δt late changes it by ΔH = K δt.
// Volumes give the same without a clock, so this file uses them:
//
//   H = ΔV / (d · ΔL)     ΔV: filament pushed in mm³, ΔL: way of the nozzle meanwhile in mm
//
// It is taken over stretches of kStretchMm of laid line, because one microstep of filament is a
// third of a millimetre of line. Filament counts as laid once it passes the furthest point that it
// ever reached: a retraction and its return lay nothing.
//
// A layer begins where plastic is laid at a height that differs by more than kLayerPitchMm from
// that of the present layer. Invariants: at most kLayerLimit layers are kept (later ones go into
// the last); Σ layer volumes == volume.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "twin/machine.h"

namespace qduino::twin {

struct Layer {
    double z_mm = 0;
    double volume_mm3 = 0;
    double length_mm = 0;  ///< laid while moving
    double minimum_x_mm = 0, maximum_x_mm = 0, minimum_y_mm = 0, maximum_y_mm = 0;
    std::uint64_t stretches = 0;
    double height_sum_mm = 0, height_square_sum_mm2 = 0;
    double height_minimum_mm = 0, height_maximum_mm = 0;  ///< over stretches

    [[nodiscard]] double height_mean_mm() const {
        return stretches == 0 ? 0.0 : height_sum_mm / static_cast<double>(stretches);
    }
    [[nodiscard]] double height_deviation_mm() const;  ///< standard deviation over stretches
};

class Deposit {
  public:
    static constexpr double kStretchMm = 5.0;
    static constexpr double kLayerPitchMm = 0.04;
    static constexpr std::size_t kLayerLimit = 10'000;

    Deposit(const Machine& machine, std::int64_t extruder_position);

    /// The extruder reached `position` (microsteps) while the nozzle stood at x, y, z (mm of
    /// machine coordinates; z without what follows a bed that is not plane).
    void extruder_at(std::int64_t position, const std::array<double, kSlideCount>& nozzle_mm);
    /// Ends the last stretch. Call before reading the layers.
    void finish();

    [[nodiscard]] const std::vector<Layer>& layers() const { return layers_; }
    [[nodiscard]] double volume_mm3() const { return volume_mm3_; }
    /// Layers that went into the last one because the list was full.
    [[nodiscard]] std::uint64_t layers_merged() const { return merged_; }

  private:
    struct Stretch {
        double volume_mm3 = 0;
        double length_mm = 0;
    };
    void begin_layer(const std::array<double, kSlideCount>& nozzle_mm);
    void end_stretch();

    double step_volume_mm3_;
    double line_width_mm_;
    std::int64_t furthest_;
    // The step before this one laid plastic, too, so the way from there is laid line.
    bool laying_ = false;
    std::array<double, kSlideCount> last_mm_{};
    Stretch stretch_{};
    double volume_mm3_ = 0;
    std::uint64_t merged_ = 0;
    std::vector<Layer> layers_;
};

}  // namespace qduino::twin
