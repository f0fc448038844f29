// The asked path: what a G-code file demands of the machine, as straight pieces in machine
// coordinates, read lazily.
//
// Geometry alone: G0 G1 G2 G3 (I J or R), G20 G21, G90 G91, G92, G28, M82 M83, M221. Feed rates,
// heat and everything else change when a part is made, never which part. The dialect is Marlin's:
// - G90/G91 set E along with X Y Z; M82/M83 set E alone afterwards.
// - M221 scales every E movement from then on; the words still mean unscaled filament.
// - G92 renames the present position (nothing moves; without a letter every axis is 0). G28 also
//   forgets the G92 of the axes that it homes.
// - An arc becomes chords that stay within kChordErrorMm of it.
//
// Invariant: each item starts where the one before it ended; items that move nothing are not given.
#pragma once

#include <array>
#include <cstdint>

#include "twin/byte_source.h"
#include "twin/line_reader.h"
#include "twin/machine.h"

namespace qduino::twin {

/// In mm of machine coordinates. E: filament since the start, flow applied.
using Position = std::array<double, kAxisCount>;

struct AskedItem {
    enum class Kind : std::uint8_t { move, home, end };
    Kind kind = Kind::end;
    std::uint8_t homed = 0;  ///< home: bit per slide
    std::uint64_t line = 0;
    Position to{};  ///< where this item ends
};

class AskedPath {
  public:
    static constexpr double kChordErrorMm = 0.0002;

    /// `start`: the machine's position before the first line. `home_mm`: coordinates of the
    /// switches.
    AskedPath(ByteSource& source, const Position& start, const std::array<double, kSlideCount>& home_mm)
        : lines_(source), home_mm_(home_mm), machine_(start), logical_e_(start[kExtruder]) {}

    /// The next item; Kind::end for ever once the source has ended.
    [[nodiscard]] AskedItem next();
    /// The end of the items given out so far.
    [[nodiscard]] const Position& position() const { return machine_; }

    /// Sum of all E movements given out so far, and of the positive ones, in mm.
    [[nodiscard]] double filament_net_mm() const { return filament_net_mm_; }
    [[nodiscard]] double filament_pushed_mm() const { return filament_pushed_mm_; }

  private:
    struct Arc {
        bool active = false;
        double centre_x = 0, centre_y = 0, radius = 0, start_angle = 0, sweep = 0;
        int chord = 0, chords = 0;
        Position from{}, to{};
    };

    bool run(const CommandLine& command, AskedItem& item);
    bool run_g(const CommandLine& command, AskedItem& item);
    bool begin_arc(const CommandLine& command, bool clockwise, AskedItem& item);
    bool home(const CommandLine& command, AskedItem& item);
    void rename(const CommandLine& command);
    [[nodiscard]] Position target(const CommandLine& command);
    [[nodiscard]] Position arc_point(int chord) const;
    bool emit(const Position& to, AskedItem& item);

    LineReader lines_;
    std::array<double, kSlideCount> home_mm_;
    Position machine_;
    std::array<double, kSlideCount> offset_{};  // machine = word + offset (G92)
    double logical_e_;
    double unit_mm_ = 1;
    double flow_ = 1;
    bool relative_ = false;
    bool relative_e_ = false;
    double filament_net_mm_ = 0;
    double filament_pushed_mm_ = 0;
    Arc arc_{};
};

}  // namespace qduino::twin
