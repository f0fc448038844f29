// Where the motors must stand for the nozzle to be where a file wants it, and back: axes put
// straight, the measured bed followed, in microsteps from coordinate 0.
//
// Pure but for the beds that are being measured.
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "twin/asked_bed.h"
#include "twin/bed_map.h"
#include "twin/gantry.h"
#include "twin/machine.h"

namespace qduino::twin {

/// Microsteps of each motor from coordinate 0; between two steps they may be fractional.
using MotorPoint = std::array<double, kAxisCount>;

class MotorSpace {
  public:
    MotorSpace(const Machine& machine, std::map<int, BedMap> maps)
        : machine_(machine), gantry_(machine), maps_(std::move(maps)) {}

    [[nodiscard]] const Machine& machine() const { return machine_; }
    [[nodiscard]] const Gantry& gantry() const { return gantry_; }
    [[nodiscard]] double steps_per_mm(std::size_t motor) const { return machine_.axes[motor].steps_per_mm; }

    [[nodiscard]] MotorPoint to_steps(const Position& mm) const {
        MotorPoint steps = gantry_.motors_at(mm);
        for (std::size_t axis = 0; axis < kAxisCount; ++axis) steps[axis] *= steps_per_mm(axis);
        return steps;
    }
    [[nodiscard]] Position to_mm(const MotorPoint& steps) const {
        Position motors = steps;
        for (std::size_t axis = 0; axis < kAxisCount; ++axis) motors[axis] /= steps_per_mm(axis);
        return gantry_.nozzle_at(motors);
    }

    /// Where the nozzle must be for the part to be as asked.
    [[nodiscard]] Position corrected(const Position& asked, const AskedCorrection& by) const {
        Position at = asked;
        const auto [xy, xz, yz] = by.skew;
        at[1] -= yz * asked[2];
        at[0] -= xy * asked[1] + (xz - xy * yz) * asked[2];
        if (follows_bed(by))
            at[2] += fade_at(asked[2], by.fade_end_mm) * maps_.at(by.map).height_at(at[0], at[1]);
        return at;
    }
    /// A measured bed makes the way bend.
    [[nodiscard]] bool follows_bed(const AskedCorrection& by) const {
        return by.follows_bed && maps_.contains(by.map);
    }
    /// How much of the height of a nozzle there, in mm, follows the bed of that number (0: none).
    [[nodiscard]] double lift_by_bed(const Position& nozzle, int number, double fade_end_mm) const {
        const auto map = maps_.find(number);
        if (number == 0 || map == maps_.end()) return 0;
        const double height = map->second.height_at(nozzle[0], nozzle[1]);
        // Solves asked + fade(asked)·height = built: each round leaves height / span of the error.
        double lift = height;
        for (int i = 0; i < 6; ++i) lift = fade_at(nozzle[2] - lift, fade_end_mm) * height;
        return lift;
    }

    /// The bed is measured anew, as number `number`.
    void begin_map(int number) { maps_.insert_or_assign(number, BedMap{machine_.grid}); }
    [[nodiscard]] BedMap& map(int number) { return maps_.at(number); }
    [[nodiscard]] const std::map<int, BedMap>& maps() const { return maps_; }

  private:
    /// The share of the bed's height that is followed so far above it.
    [[nodiscard]] double fade_at(double asked_z_mm, double fade_end_mm) const {
        const double above = asked_z_mm - machine_.grid.fade_start_mm;
        const double span = fade_end_mm - machine_.grid.fade_start_mm;
        return fade_end_mm > 0 && above > 0 ? std::max(1 - above / span, 0.0) : 1.0;
    }

    Machine machine_;
    Gantry gantry_;
    std::map<int, BedMap> maps_;
};

}  // namespace qduino::twin
