// The planner's output: a move whose speeds are final, or an event between two moves.
#pragma once

#include <cstdint>

#include "printer/motion/move.h"
#include "printer/motion/trapezoid.h"

namespace qduino::printer::motion {

/// An instant on the print's own time line: whole nanoseconds, and the fraction of one. A sum of
/// durations does not drift: it loses only the rounding of a double within one segment, 1e-7 ns in
/// a second.
struct TimelineInstant {
    std::int64_t ns = 0;
    double fraction_ns = 0;  ///< 0 <= fraction < 1

    void advance_s(double duration_s) {
        const double sum_ns = fraction_ns + duration_s * 1e9;
        const auto whole_ns = static_cast<std::int64_t>(sum_ns);
        ns += whole_ns;
        fraction_ns = sum_ns - static_cast<double>(whole_ns);
    }
    /// The nearest nanosecond to this instant plus `offset_s` >= 0.
    [[nodiscard]] std::int64_t ns_after(double offset_s) const {
        return ns + static_cast<std::int64_t>(fraction_ns + offset_s * 1e9 + 0.5);
    }
};

enum class SegmentKind : std::uint8_t {
    move,   ///< everything below counts
    dwell,  ///< time passes from `start` to `end` at `start_mm`, at rest
    /// `value` is to be reported when everything before it has been played. In full motion; takes
    /// no time.
    marker,
    homing,   ///< the switch of `axis` ends the steps of the motors in `value`; at rest
    filters,  ///< `filters` are in force from here on; at rest
};

struct Segment {
    SegmentKind kind = SegmentKind::move;
    Axis axis = Axis::x;
    std::uint32_t value = 0;
    TimelineInstant start;
    TimelineInstant end;
    AxisVector start_mm{};
    AxisVector end_mm{};
    Trapezoid shape;       ///< along X, Y, Z, or along E when nothing else moves
    double advance_s = 0;  ///< pressure advance of this move
    MotionFilters filters{};
};

}  // namespace qduino::printer::motion
