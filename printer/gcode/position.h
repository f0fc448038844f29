// A place of the machine on its four axes, and sets of axes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "base/quantity.h"
#include "printer/machine_config.h"

namespace qduino::printer::gcode {

/// X, Y and Z in machine coordinates; E is the filament pushed since start, never reset by G92.
using Position = PerAxis<Millimetres>;

inline constexpr std::array<Axis, kAxisCount> kAllAxes{Axis::x, Axis::y, Axis::z, Axis::e};
/// The axes that carry the tool: what can be homed and what has bounds.
inline constexpr std::array<Axis, 3> kToolAxes{Axis::x, Axis::y, Axis::z};

class AxisSet {
  public:
    constexpr AxisSet() = default;
    static constexpr AxisSet all() { return AxisSet{0b1111}; }
    static constexpr AxisSet tool() { return AxisSet{0b0111}; }

    constexpr AxisSet& add(Axis axis) { return bits_ = static_cast<std::uint8_t>(bits_ | bit(axis)), *this; }
    [[nodiscard]] constexpr bool contains(Axis axis) const { return (bits_ & bit(axis)) != 0; }
    [[nodiscard]] constexpr bool empty() const { return bits_ == 0; }
    friend constexpr bool operator==(AxisSet, AxisSet) = default;

  private:
    explicit constexpr AxisSet(std::uint8_t bits) : bits_(bits) {}
    static constexpr std::uint8_t bit(Axis axis) {
        return static_cast<std::uint8_t>(1U << static_cast<unsigned>(axis));
    }
    std::uint8_t bits_ = 0;
};

}  // namespace qduino::printer::gcode
