// Height map: how high the plastic lies along the path, against how high the file asks it to lie.
//
//   E steps ──► Melt ──► what left the tip since the last step of X or Y
//                              │            laid on the way that the nozzle made meanwhile
//   X Y steps ─► Inspector ────┴─► (x, y, z, e) asked there
//
//   height of a cell = volume / (nozzle width · way)            the paper's equation 2, by volumes
//
// The way is that of the inspector's place on the asked path: a step of X or Y happens where the
// path crosses a half step, so the way between two steps is known to far less than a microstep.
//
// Two sizes of cell. Over kCellMm, about the width of a line, plastic levels itself: errors of
// height are counted there. Over one microstep a late step shows: a machine passes a straight line
// of the file by speeding up, going on and slowing down, so the time that a microstep takes has no
// peak inside the line. A peak is lateness δt, and its rise ΔH = K δt (the paper's equation 3). On
// curves the place is not known well enough for that.
//
// What leaves the tip where no plastic is asked for is ooze: on a way without extrusion, or where
// the nozzle rests.
//
// Invariant: laid + ooze + what more is in the nozzle == pushed. Memory is bounded: kWorst of each
// kind of fault; cells only when they are to be kept, every second one beyond kCellLimit, and so
// on.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/histogram.h"
#include "base/time.h"
#include "twin/machine.h"
#include "twin/melt.h"

namespace qduino::twin {

/// A place of the part, and the line of the file that asks for it.
struct PlaceOfLine {
    std::array<double, kSlideCount> mm{};
    std::uint64_t line = 0;
};

/// A microstep that came late: its line is thicker there.
struct LateSpot {
    PlaceOfLine place;
    double late_s = 0;
    double rise_mm = 0;  ///< ΔH over one microstep
};

/// Plastic that left the tip on one way without extrusion, or at one rest (way_mm 0).
struct Ooze {
    PlaceOfLine from;
    double way_mm = 0;
    double volume_mm3 = 0;
};

/// A stretch of laid line, for a picture. It begins where the one before ends, if `joined`.
struct HeightCell {
    float x_mm = 0, y_mm = 0, z_mm = 0;  ///< of its end
    float error = 0;                     ///< (built − asked) / asked height
    bool joined = false;
};

struct Heights {
    double laid_mm3 = 0;   ///< where plastic is asked for
    double asked_mm3 = 0;  ///< there
    double way_mm = 0;     ///< of laid line
    double travel_ooze_mm3 = 0;
    double rest_ooze_mm3 = 0;   ///< among it what is purged in one place
    double in_nozzle_mm3 = 0;   ///< at the end, with what the gear has yet to push (melt.h)
    Histogram error_nm;         ///< |built − asked| of each cell
    double worst_error_mm = 0;  ///< the largest of them, with its sign …
    PlaceOfLine worst;          ///< … and where that is
    std::uint64_t late_spot_count = 0;
    std::vector<LateSpot> late_spots;  ///< the highest first
    std::vector<Ooze> oozes;           ///< the largest first
    std::vector<HeightCell> cells;
};

class HeightMap {
  public:
    static constexpr double kCellMm = 0.4;
    /// Nothing moved sideways for this long: a rest.
    static constexpr Nanoseconds kRest{40'000'000};
    /// A late spot is one that rises by this share of the height asked for, at least.
    static constexpr double kSpotShare = 0.05;
    static constexpr std::size_t kWorst = 20;
    static constexpr std::size_t kCellLimit = std::size_t{1} << 21;

    HeightMap(const Machine& machine, bool keep_cells);

    /// The extruder made a microstep.
    void extruder_step(Instant now, int direction) { melt_.push(now, direction); }
    void set_hot(Instant now, bool hot) { melt_.set_hot(now, hot); }
    /// X or Y made a step, and stands for `asked_mm` (X, Y, Z, E) of the path. `straight`: that is
    /// no curve.
    void slide_step(Instant now, const std::array<double, kAxisCount>& asked_mm, std::uint64_t line,
                    bool straight);
    /// The head is not on the path (it homes, or is away): what flows is ooze at a rest.
    void leave_path(Instant now);
    /// Ends the last cells, and gives what was found. Nothing may follow.
    [[nodiscard]] Heights finish(Instant now);

  private:
    /// A stretch of laid line.
    struct Cell {
        double volume_mm3 = 0, asked_mm3 = 0, way_mm = 0, seconds = 0;
        PlaceOfLine end;
        bool straight = true;  ///< on one line of the file, and that is no curve
        void add(const Cell& more);
        [[nodiscard]] double pace() const { return seconds / way_mm; }
    };

    void lay(const Cell& piece);
    void judge_step(const Cell& next);
    void end_line();
    void end_cell();
    void keep_cell(double error);
    void ooze(double volume_mm3, double way_mm);
    void end_ooze();

    Melt melt_;
    double mm3_per_mm_;  // of filament
    double width_mm_;
    double step_mm_;  // the longer one of X and Y
    bool keep_cells_;
    std::size_t every_ = 1;  // of so many cells one is kept
    std::size_t passed_ = 0;

    bool placed_ = false;
    Instant at_{};
    std::array<double, kAxisCount> last_mm_{};
    double furthest_mm_ = 0;  // of filament, as asked
    PlaceOfLine place_;
    double left_mm3_ = 0;  // the tip since at_
    Cell cell_;
    Cell step_;                   // of at least one microstep
    std::array<Cell, 2> before_;  // whole ones in front of it, on the same line
    int whole_ = 0;
    bool joined_ = false;
    Ooze ooze_;
    Heights found_;
};

}  // namespace qduino::twin
