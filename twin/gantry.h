// What the motors move: from the nozzle to the motors and back, on this machine's own numbers.
//
//   cartesian   each motor drives one slide
//   CoreXY      two belts over both motors: their sum is X, their difference is Y
//   delta       three carriages on columns around the bed; an arm from each to the nozzle
//
// A slide is what has ends, and a switch at one of them: an axis, or a delta's carriage. A slide's
// steps are whole numbers: those of its motor, and on CoreXY the sum and the difference of two
// motors', which are half as long.
//
// The printer has a kinematics of its own and shares nothing with this file: a mistake in one must
// not hide in the other. The nozzle of a delta is found here by turning the frame of reference so
// that the three joints lie in one plane (true-range multilateration with three spheres).
//
// Pure. Lengths in mm.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "twin/machine.h"

namespace qduino::twin {

/// One count per motor, or per slide.
using Counts = std::array<std::int64_t, kAxisCount>;

class Gantry {
  public:
    explicit Gantry(const Machine& machine)
        : type_(machine.gantry), arm_mm_(machine.delta.arm_mm), columns_(columns_of(machine.delta)) {}

    [[nodiscard]] bool is_linear() const { return type_ != GantryType::delta; }

    /// Where the motors stand, in mm, when the nozzle is there.
    [[nodiscard]] Position motors_at(const Position& nozzle) const {
        if (type_ == GantryType::cartesian) return nozzle;
        if (type_ == GantryType::corexy)
            return {nozzle[0] + nozzle[1], nozzle[0] - nozzle[1], nozzle[2], nozzle[3]};
        Position motors{0, 0, 0, nozzle[kExtruder]};
        for (std::size_t i = 0; i < kSlideCount; ++i) {
            const double sideways = std::hypot(nozzle[0] - columns_[i][0], nozzle[1] - columns_[i][1]);
            motors[i] = nozzle[2] + std::sqrt(std::max((arm_mm_ - sideways) * (arm_mm_ + sideways), 0.0));
        }
        return motors;
    }

    /// Where the nozzle is; not a number where no nozzle can hang from a delta's carriages.
    [[nodiscard]] Position nozzle_at(const Position& motors) const {
        if (type_ == GantryType::cartesian) return motors;
        if (type_ == GantryType::corexy)
            return {(motors[0] + motors[1]) / 2, (motors[0] - motors[1]) / 2, motors[2], motors[3]};
        return hang(motors);
    }

    /// Bit per slide that moves with `motor`.
    [[nodiscard]] std::uint8_t slides_of(std::size_t motor) const {
        if (motor >= kSlideCount) return 0;
        return type_ == GantryType::corexy && motor < 2 ? 0b011 : static_cast<std::uint8_t>(1u << motor);
    }
    /// Bit per motor that moves with one of `slides`.
    [[nodiscard]] std::uint8_t motors_of(std::uint8_t slides) const {
        std::uint8_t motors = 0;
        for (std::size_t motor = 0; motor < kSlideCount; ++motor)
            if ((slides_of(motor) & slides) != 0) motors = static_cast<std::uint8_t>(motors | 1u << motor);
        return motors;
    }
    /// The place of a slide, in steps of its own.
    [[nodiscard]] std::int64_t slide_steps(std::size_t slide, const Counts& motors) const {
        if (type_ != GantryType::corexy || slide > 1) return motors[slide];
        return slide == 0 ? motors[0] + motors[1] : motors[0] - motors[1];
    }
    [[nodiscard]] double slide_steps_per_mm(std::size_t slide, double motor_steps_per_mm) const {
        return motor_steps_per_mm * (type_ == GantryType::corexy && slide < 2 ? 2 : 1);
    }

    /// The way of `motor` for a millimetre of the nozzle's there, in the direction that moves it
    /// most: the length of its gradient.
    [[nodiscard]] double rate_of(std::size_t motor, const Position& nozzle) const {
        if (motor >= kSlideCount || type_ == GantryType::cartesian) return 1;
        if (type_ == GantryType::corexy) return motor < 2 ? std::numbers::sqrt2 : 1;
        const double sideways = std::hypot(nozzle[0] - columns_[motor][0], nozzle[1] - columns_[motor][1]);
        return arm_mm_ / std::sqrt(std::max((arm_mm_ - sideways) * (arm_mm_ + sideways), 1.0));
    }

    /// How far motors may be off when the nozzle may be off by so much sideways (X and Y have the
    /// same number: of both together) and upwards. An arm of a delta is taken to rise by half its
    /// length at least: sideways by 1, its carriage goes by √3 at most.
    [[nodiscard]] Position reach_of(const Position& axes) const {
        if (type_ == GantryType::cartesian) return axes;
        const double belt = std::numbers::sqrt2 * axes[0];
        if (type_ == GantryType::corexy) return {belt, belt, axes[2], axes[kExtruder]};
        const double carriage = std::numbers::sqrt3 * axes[0] + axes[2];
        return {carriage, carriage, carriage, axes[kExtruder]};
    }

    /// Into so many straight pieces the way between two places must be cut for each motor to leave
    /// its piece by no more than `error_mm`.
    [[nodiscard]] int pieces_of(const Position& from, const Position& to, double error_mm) const {
        if (is_linear()) return 1;
        const double way = std::hypot(to[0] - from[0], to[1] - from[1]);
        double sharpest = 0;  // bend of a carriage's curve: L²/h³, the arm at its flattest
        for (const auto& column : columns_) {
            const double reach = std::max(std::hypot(from[0] - column[0], from[1] - column[1]),
                                          std::hypot(to[0] - column[0], to[1] - column[1]));
            const double rise2 = std::max(arm_mm_ * arm_mm_ - reach * reach, 1.0);
            sharpest = std::max(sharpest, arm_mm_ * arm_mm_ / (rise2 * std::sqrt(rise2)));
        }
        return std::max(1, static_cast<int>(std::ceil(way * std::sqrt(sharpest / (8 * error_mm)))));
    }

  private:
    using Vector = std::array<double, 3>;
    using Columns = std::array<std::array<double, 2>, kSlideCount>;

    static Columns columns_of(const DeltaSpec& delta) {
        Columns columns{};
        for (std::size_t i = 0; i < kSlideCount; ++i) {
            const double angle = delta.angle_degrees[i] / 180 * std::numbers::pi;
            columns[i] = {delta.radius_mm * std::cos(angle), delta.radius_mm * std::sin(angle)};
        }
        return columns;
    }

    static double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
    static Vector cross(const Vector& a, const Vector& b) {
        return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    }
    /// a + k·b
    static Vector along(const Vector& a, double k, const Vector& b) {
        return {a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2]};
    }
    static Vector unit(const Vector& a) { return along({}, 1 / std::sqrt(dot(a, a)), a); }

    [[nodiscard]] Position hang(const Position& motors) const {
        const auto joint = [&](std::size_t i) { return Vector{columns_[i][0], columns_[i][1], motors[i]}; };
        const Vector first = joint(0), second = along(joint(1), -1, first),
                     third = along(joint(2), -1, first);
        const Vector ex = unit(second);
        const double i = dot(ex, third);
        const Vector ey = unit(along(third, -i, ex));
        const Vector ez = cross(ex, ey);
        const double d = std::sqrt(dot(second, second)), j = dot(ey, third);
        // The arms are equally long, so their lengths cancel.
        const double x = d / 2;
        const double y = (i * i + j * j) / (2 * j) - i / j * x;
        const double z = std::sqrt(arm_mm_ * arm_mm_ - x * x - y * y);
        const double down = ez[2] > 0 ? -z : z;
        const Vector nozzle = along(along(along(first, x, ex), y, ey), down, ez);
        return {nozzle[0], nozzle[1], nozzle[2], motors[kExtruder]};
    }

    GantryType type_;
    double arm_mm_;
    Columns columns_;
};

/// The coordinates of a nozzle whose slides all stand at their switches.
[[nodiscard]] inline Position home_of(const Machine& machine) {
    Position home{};
    for (std::size_t i = 0; i < kSlideCount; ++i) home[i] = machine.axes[i].home_mm;
    return machine.gantry == GantryType::delta ? Gantry{machine}.nozzle_at(home) : home;
}

}  // namespace qduino::twin
