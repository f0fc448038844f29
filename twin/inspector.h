// Inspector: is the part that was built the part that was asked for? Built is a stream of
// microsteps. Asked is a path of straight pieces in (x, y, z, e). No clock is needed: the order of
// the steps alone tells where on the path the machine is.
//
//   pins ──► Inspector ─┬─► a slide's or E's step ──► StraightFollower ─┐  straight_follower.h
//                       │                             (CurveFollower)   ├──► PathCursor ◄── file
//                       │            behind a shaper: ShapedFollower ───┘    path_cursor.h
//                       ├─► a step that a G28 or G29 explains ──► Homing, Probing
//                       └─► a rest ──► Excursions: away from the path, and back to the very step
//
// All this is in steps of motors (gantry.h).
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "base/time.h"
#include "twin/advance_watch.h"
#include "twin/byte_source.h"
#include "twin/excursions.h"
#include "twin/findings.h"
#include "twin/homing.h"
#include "twin/inspection_start.h"
#include "twin/machine.h"
#include "twin/observer.h"
#include "twin/path_cursor.h"
#include "twin/probing.h"
#include "twin/shaped_follower.h"
#include "twin/straight_follower.h"

namespace qduino::twin {

class Inspector {
  public:
    /// `source` must outlive the inspector.
    Inspector(const Machine& machine, ByteSource& source, const InspectionStart& start)
        : cursor_(machine, source, start),
          motors_{start.built, start.origin, start.pressed, {}},
          excursions_(cursor_, motors_),
          homing_(cursor_, motors_, excursions_),
          probing_(cursor_, motors_, excursions_, start.bed.maps()),
          straight_(cursor_, homing_, probing_),
          shaped_(cursor_, homing_, probing_) {}
    Inspector(const Inspector&) = delete;
    Inspector& operator=(const Inspector&) = delete;

    void on_step(const StepSeen& step);
    void on_endstop(Instant at, int axis, bool pressed);
    void on_probe(Instant at);
    /// A line that was typed beside the job, and that changes what is asked from then on
    /// (AskedLines::insert).
    void on_typed(std::uint64_t behind_line, std::string_view line, double left_mm = 0);

    /// Call when everything that will be built is built: passes the rest of the path, and sums up.
    /// A job that was cut short is compared with all that the file asks when `read_rest` is set
    /// (which takes as long as reading it does), else with what was read until then.
    [[nodiscard]] Findings finish(Instant now, bool read_rest = true);
    /// The start of the next job of the same session: the place that was asked last, and where its
    /// zero lies. After finish().
    [[nodiscard]] InspectionStart next_start() const;
    /// Steps of each slide at which it came to rest on its switch, where it was homed.
    [[nodiscard]] const std::array<std::int64_t, kSlideCount>& homed_at() const { return homing_.homed_at(); }
    /// Slides that look for their switches now, as a mask.
    [[nodiscard]] std::uint8_t homing() const { return homing_.pending(); }
    [[nodiscard]] std::uint64_t line() const { return cursor_.shown().line; }
    /// The head has left the path: filament pushed now is no part of the print.
    [[nodiscard]] bool away() const { return excursions_.away(); }
    /// The place on the path is known: no axis is being homed, and the head is not away.
    [[nodiscard]] bool on_path() const { return !away() && !homing_.active(); }
    /// That place, in microsteps from coordinate 0; between two steps it may be fractional.
    [[nodiscard]] const MotorPoint& asked_steps() const { return cursor_.so_far().at; }
    [[nodiscard]] bool on_curve() const { return cursor_.shown().curved; }
    /// How much of the height of a nozzle there, in mm, follows the bed that was measured. What is
    /// left is the height that the file asks for.
    [[nodiscard]] double lift_by_bed(const Position& nozzle) const {
        const AskedPiece& here = cursor_.pieces().front();
        return cursor_.pieces().space().lift_by_bed(nozzle, here.map, here.fade_end_mm);
    }
    /// Microsteps that E moved on excursions, all together.
    [[nodiscard]] std::int64_t pushed_away() const { return excursions_.pushed_away(); }

  private:
    void rest();
    void watch_advance(int direction);
    void sum_up(AxisFindings& found, std::size_t axis) const;

    PathCursor cursor_;
    SeenMotors motors_;
    Excursions excursions_;
    Homing homing_;
    Probing probing_;
    StraightFollower straight_;
    ShapedFollower shaped_;
    AdvanceWatch advance_;
    Position final_asked_{};
};

}  // namespace qduino::twin
