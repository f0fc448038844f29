// From the tool's position to the motors', and back: cartesian, CoreXY and linear delta machines.
//
// Motors have the numbers of axes: motor 0 is on the pins of X, 1 on those of Y, 2 of Z, 3 of E. Z
// and E of a linear machine, and E of a delta, have a motor of their own.
//
//   cartesian   motor = axis
//
//   CoreXY      A = x + y      one belt over two motors: both turn one way for X, and against
//               B = x − y      each other for Y (I. Moyer, corexy.com: Theory)
//
//   delta            carriage C               three columns on a circle. An arm of the length L
//                    │╲ L                     hangs from each carriage; the effector stays level.
//        A │         │ ╲        │ B           The arm's sideways reach is d, so the carriage is
//          │         │  ╲       │             higher than the nozzle by √(L² − d²):
//          ╲─────────┴───●──────╱
//            L          nozzle                h = z + √(L² − (x − X)² − (y − Y)²)
//
// Back from three carriages: the nozzle is L away from each joint, so it is where three spheres
// meet. Two differences of their equations are linear in x and y; what is left is a quadratic in z,
// and the nozzle is at its lower root (S. Graves, "Delta robot kinematics", 2012; Klipper's
// mathutil.trilateration says the same with vectors).
//
// A straight line of the tool is a straight line of the motors on a linear machine. On a delta a
// carriage follows z + √(a concave quadratic): a concave curve. So it is fastest at an end of the
// line, and it is highest at one place, which a search finds.
//
// Pure values; 300 bytes. Lengths in mm.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "printer/machine_config.h"

namespace qduino::printer {

/// One number per axis, or per motor.
using AxisValues = PerAxis<double>;
/// Bit per motor.
using MotorMask = std::uint32_t;

constexpr MotorMask motor_bit(Axis motor) { return 1u << static_cast<unsigned>(motor); }

class Kinematics {
  public:
    Kinematics() = default;
    explicit Kinematics(const MachineConfig& machine) : type_(machine.kinematics.type) {
        if (type_ == KinematicsType::delta) build_towers(machine);
    }

    [[nodiscard]] KinematicsType type() const { return type_; }
    /// In a straight line of the tool every motor moves in proportion.
    [[nodiscard]] bool is_linear() const { return type_ != KinematicsType::delta; }

    /// Motor positions: CoreXY's are mm of belt, a delta's are the carriages' heights. Where no arm
    /// reaches, the carriage is taken to be level with the nozzle.
    [[nodiscard]] AxisValues motors_from_tool(const AxisValues& tool) const {
        switch (type_) {
            case KinematicsType::cartesian:
                break;
            case KinematicsType::corexy:
                return {tool[0] + tool[1], tool[0] - tool[1], tool[2], tool[3]};
            case KinematicsType::delta:
                return {tool[2] + rise(0, tool), tool[2] + rise(1, tool), tool[2] + rise(2, tool), tool[3]};
        }
        return tool;
    }

    /// The tool's position from the motors': the machine's place from its step counts. Where no
    /// nozzle could hang from the carriages, it is a place near to that.
    [[nodiscard]] AxisValues tool_from_motors(const AxisValues& motors) const {
        switch (type_) {
            case KinematicsType::cartesian:
                break;
            case KinematicsType::corexy:
                return {(motors[0] + motors[1]) / 2, (motors[0] - motors[1]) / 2, motors[2], motors[3]};
            case KinematicsType::delta:
                return meet(motors);
        }
        return motors;
    }

    /// The motors that turn when the tool moves along `axis`.
    [[nodiscard]] MotorMask motors_of(Axis axis) const {
        const bool sideways = axis == Axis::x || axis == Axis::y;
        if (axis == Axis::e || type_ == KinematicsType::cartesian) return motor_bit(axis);
        if (type_ == KinematicsType::corexy) return sideways ? 0b0011 : motor_bit(axis);
        return 0b0111;
    }
    /// `axis` moves a motor that one of `others`, a set of axes, moves, too.
    template <typename Axes>
    [[nodiscard]] bool shares_motor(Axis axis, const Axes& others) const {
        for (const Axis other : {Axis::x, Axis::y, Axis::z})
            if (others.contains(other) && (motors_of(axis) & motors_of(other)) != 0) return true;
        return false;
    }
    /// The motors that stop when the switch of `axis` is pressed: on a delta each tower's own.
    [[nodiscard]] MotorMask stopped_by(Axis axis) const {
        return type_ == KinematicsType::delta ? motor_bit(axis) : motors_of(axis);
    }
    /// All switches are looked for in one go, and only together they say where the tool is.
    [[nodiscard]] bool homes_together() const { return type_ == KinematicsType::delta; }

    /// How far each motor goes at most for a millimetre of the straight way from `from` to `to`,
    /// whose length is `length` > 0.
    [[nodiscard]] AxisValues rates(const AxisValues& from, const AxisValues& to, double length) const {
        AxisValues rates{};
        if (is_linear()) {
            const AxisValues begin = motors_from_tool(from), end = motors_from_tool(to);
            for (std::size_t i = 0; i < kAxisCount; ++i) rates[i] = std::abs((end[i] - begin[i]) / length);
            return rates;
        }
        for (std::size_t tower = 0; tower < kTowerCount; ++tower)
            rates[tower] = std::max(climb(tower, from, to, from, length), climb(tower, from, to, to, length));
        rates[3] = std::abs((to[3] - from[3]) / length);
        return rates;
    }

    // ---- the room that a tool has: a linear machine's is a box, which is checked elsewhere
    // -------

    /// 0: the bed has no round edge.
    [[nodiscard]] double bed_radius() const { return bed_radius_; }
    [[nodiscard]] bool is_on_bed(double x, double y, double tolerance) const {
        return bed_radius_ <= 0 || std::hypot(x, y) <= bed_radius_ + tolerance;
    }
    /// On the straight way from `from` to `to` no carriage goes above its switch by more than
    /// `tolerance`.
    [[nodiscard]] bool carriages_have_room(const AxisValues& from, const AxisValues& to,
                                           double tolerance) const {
        if (is_linear() || std::max(from[2], to[2]) <= free_height_) return true;
        for (std::size_t tower = 0; tower < kTowerCount; ++tower)
            if (highest(tower, from, to) > switch_height_[tower] + tolerance) return false;
        return true;
    }
    /// The highest place of the tool above x, y.
    [[nodiscard]] double ceiling(double x, double y) const {
        double z = switch_height_[0] - rise(0, {x, y});
        for (std::size_t tower = 1; tower < kTowerCount; ++tower)
            z = std::min(z, switch_height_[tower] - rise(tower, {x, y}));
        return z;
    }
    /// The tool's place when all carriages are at their switches. Only a delta has one.
    [[nodiscard]] AxisValues at_switches() const {
        return tool_from_motors({switch_height_[0], switch_height_[1], switch_height_[2], 0});
    }

  private:
    static constexpr double square(double x) { return x * x; }

    struct Place {
        double x = 0, y = 0;
    };

    void build_towers(const MachineConfig& machine) {
        const KinematicsConfig& numbers = machine.kinematics;
        const double radius = numbers.delta_radius.value();
        arm2_ = square(numbers.arm_length.value());
        bed_radius_ = numbers.bed_radius.value();
        const double home = numbers.home_height.value() + std::sqrt(std::max(arm2_ - square(radius), 0.0));
        for (std::size_t tower = 0; tower < kTowerCount; ++tower) {
            const double angle = numbers.tower_angle_degrees[tower] * std::numbers::pi / 180;
            towers_[tower] = {radius * std::cos(angle), radius * std::sin(angle)};
            switch_height_[tower] = home + numbers.endstop_offset[tower].value();
        }
        free_height_ = *std::ranges::min_element(switch_height_) - numbers.arm_length.value();
    }

    /// How much higher than the nozzle the carriage is: √(L² − d²).
    [[nodiscard]] double rise(std::size_t tower, const AxisValues& tool) const {
        const Place& at = towers_[tower];
        return std::sqrt(std::max(arm2_ - square(tool[0] - at.x) - square(tool[1] - at.y), kRiseMin2));
    }

    /// |dh/ds| at `here` on the way: the slope of z, and that of the arm.
    [[nodiscard]] double climb(std::size_t tower, const AxisValues& from, const AxisValues& to,
                               const AxisValues& here, double length) const {
        const Place& at = towers_[tower];
        const double outwards = (here[0] - at.x) * (to[0] - from[0]) + (here[1] - at.y) * (to[1] - from[1]);
        return std::abs((to[2] - from[2]) - outwards / rise(tower, here)) / length;
    }

    /// The carriage's greatest height. The curve is concave, so thirds find it.
    [[nodiscard]] double highest(std::size_t tower, const AxisValues& from, const AxisValues& to) const {
        const auto height = [&](double share) {
            AxisValues at{};
            for (std::size_t i = 0; i < 3; ++i) at[i] = from[i] + share * (to[i] - from[i]);
            return at[2] + rise(tower, at);
        };
        double low = 0, high = 1;
        for (int i = 0; i < 40; ++i) {
            const double third = (high - low) / 3;
            const bool is_behind = height(low + third) < height(high - third);
            (is_behind ? low : high) += is_behind ? third : -third;
        }
        return std::max({height(0), height(1), height((low + high) / 2)});
    }

    /// Where the three spheres meet (see the head).
    [[nodiscard]] AxisValues meet(const AxisValues& h) const {
        const auto sum = [&](std::size_t t) {
            return square(towers_[t].x) + square(towers_[t].y) + square(h[t]);
        };
        // x = x0 + x1·z, y = y0 + y1·z
        const double ax = 2 * (towers_[1].x - towers_[0].x), ay = 2 * (towers_[1].y - towers_[0].y);
        const double bx = 2 * (towers_[2].x - towers_[0].x), by = 2 * (towers_[2].y - towers_[0].y);
        const double a0 = sum(1) - sum(0), a1 = -2 * (h[1] - h[0]);
        const double b0 = sum(2) - sum(0), b1 = -2 * (h[2] - h[0]);
        const double det = ax * by - ay * bx;
        const double x0 = (a0 * by - b0 * ay) / det, x1 = (a1 * by - b1 * ay) / det;
        const double y0 = (ax * b0 - bx * a0) / det, y1 = (ax * b1 - bx * a1) / det;
        // (x − X)² + (y − Y)² + (z − h)² = L² with them: p z² + 2 q z + r = 0
        const double dx = x0 - towers_[0].x, dy = y0 - towers_[0].y;
        const double p = x1 * x1 + y1 * y1 + 1;
        const double q = x1 * dx + y1 * dy - h[0];
        const double r = dx * dx + dy * dy + h[0] * h[0] - arm2_;
        const double z = (-q - std::sqrt(std::max(q * q - p * r, 0.0))) / p;
        return {x0 + x1 * z, y0 + y1 * z, z, h[3]};
    }

    static constexpr double kRiseMin2 = 1;  // mm²: no arm lies flatter

    KinematicsType type_ = KinematicsType::cartesian;
    std::array<Place, kTowerCount> towers_{};
    std::array<double, kTowerCount> switch_height_{};
    double arm2_ = 0;
    double bed_radius_ = 0;
    double free_height_ = 0;  // up to here every carriage has room, wherever the tool is
};

/// A delta's axes are at home where its carriages are at their switches: works that place out of
/// `home_height`, the arms and the offsets. Nothing to do on other machines.
inline void place_delta_home(MachineConfig& machine) {
    if (machine.kinematics.type != KinematicsType::delta) return;
    const AxisValues home = Kinematics{machine}.at_switches();
    for (std::size_t i = 0; i < 3; ++i) machine.axes[i].home_position = Millimetres{home[i]};
}

}  // namespace qduino::printer
