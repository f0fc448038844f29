// From moves to the step ring, and back what came of them: planner, solver and ring as one thing
// that loop 1 fills.
//
//   append ─► planner ─► solver ─► step ring ════► loop 2 (player)
//                                                    │
//   timeline, markers, step counts ◄── four-slot ────┘
//
// How far ahead: pump() solves until `kAhead` of the print's own time lies in the ring. Loop 1 runs
// every 100 ms, so this survives seven of its releases that fail to come. More would make a pause,
// or M220, take hold later. For the same reason the planner is given no more than it needs: lines
// are read while pump() is hungry, a little at a time (machine.cpp), and a long move comes in
// pieces (job_actions.h).
//
// When nothing more can be read (a dead service, a slow one, the end of a job) and less than
// `kFlushBelow` lies ahead, what the planner kept for a better corner speed is planned down to a
// standstill: the motion ends at rest, never in mid-air.
//
// Away from the path. While the path is held (a pause), depart() puts a second planner in the place
// of the first, which keeps what is behind the stop. The head may then go anywhere through the same
// solver and ring. come_back() puts the path's planner back: X, Y and Z must stand where they left,
// E counts on from where it left, whatever was pushed meanwhile.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <numeric>

#include "channel/broadcast.h"
#include "channel/four_slot.h"
#include "channel/ring_buffer.h"
#include "printer/gcode/actions.h"
#include "printer/link/layout.h"
#include "printer/machine/compensation.h"
#include "printer/machine/limits.h"
#include "printer/machine/step_scale.h"
#include "printer/machine/stops.h"
#include "printer/motion/correction.h"
#include "printer/motion/planner.h"
#include "printer/step/solver.h"
#include "printer/step/step_event.h"

namespace qduino::printer::machine {

using StepRing = channel::RingBuffer<step::StepEvent, step::kStepRingCapacity>;

/// Pieces of an arc that are appended at once; kPlannerReserve has room for them and their markers.
inline constexpr std::size_t kArcPiecesAtOnce = 4;

class MotionPipe {
  public:
    static constexpr Nanoseconds kAhead = 800ms;
    static constexpr Nanoseconds kFlushBelow = 400ms;
    static constexpr Nanoseconds kLongDwell = 2s;
    static constexpr std::size_t kEventsPerPump = 1 << 17;  // bounds loop 1's release: about 5 ms
    /// Room that any one command may need: pieces of an arc and their markers, a homing order, or a
    /// move with the four before it that bring the head back from an object that was left out.
    static constexpr std::size_t kPlannerReserve = 16;
    /// … and where moves are split: five of them, the way to where they begin, and their markers.
    static constexpr std::size_t kSplitReserve = 5 * motion::Correction::kPiecesMax + kPlannerReserve;

    /// `emergency` (the link's counter) stops loop 2 too, without asking loop 1.
    MotionPipe(const MachineConfig& config, const std::atomic<std::uint32_t>& emergency);

    // ---- loop 1 ---------------------------------------------------------------------------------

    [[nodiscard]] bool has_room() const { return planner().free() >= room_needed(); }
    /// The planner of the motion that is fed now: the path's, or while away the other.
    [[nodiscard]] motion::Planner& planner() { return away_ ? excursion_ : planner_; }
    [[nodiscard]] const motion::Planner& planner() const { return away_ ? excursion_ : planner_; }

    /// Leaves the path where it is held. Contract: not away, planner().stopped(), played_out().
    void depart();
    [[nodiscard]] bool away() const { return away_; }
    /// Where the path was left. Contract: away().
    [[nodiscard]] const motion::AxisVector& left_at_mm() const { return planner_.held_position_mm(); }
    /// Back on the path, still held. Contract: away(), drained(), and X, Y, Z stand at
    /// left_at_mm().
    void come_back();

    /// Takes loop 2's freshest word and the service's. Once per release, before anything is
    /// decided.
    void observe() {
        stops_.observe();
        seen_ = for_loop_1_.read();
    }
    [[nodiscard]] const link::MotionCounts& seen() const { return seen_; }

    /// Solves steps into the ring, `events` at most. `more_may_come`: input is at hand, so the
    /// planner may go on hoping. Returns how many events it would still have solved, had the
    /// planner had something final for it; 0: it wants no more for now.
    std::size_t pump(bool more_may_come, std::size_t events = kEventsPerPump);

    /// Everything handed to the solver has been played.
    [[nodiscard]] bool played_out() const;
    /// Everything appended has been played.
    [[nodiscard]] bool drained() const { return planner().empty() && played_out(); }

    /// Comes to rest at the earliest end of a move, and keeps what is behind it. True: it rests
    /// there.
    [[nodiscard]] bool come_to_rest();

    /// Asked to drop everything, loop 2 has not yet done so. Nothing is pumped until it has.
    [[nodiscard]] bool stopping() const { return stops_.asked_as_seen() != seen_.stops_served; }
    /// Nothing is planned, on the path or away from it, and the machine rests at `position_mm`; a
    /// stop that loop 1 asked for is finished. Contract: not stopping().
    void reset(const motion::AxisVector& position_mm);
    /// Where the motors are, as G-code counts it; at rest the very place that was asked for.
    [[nodiscard]] motion::AxisVector played_mm() const {
        return correction_.asked_of(scale_.position_of(seen_.steps, planner().position_mm()));
    }
    /// E counts from a whole step on, wherever the last job has left it between two. Contract:
    /// drained(), no stop runs.
    void settle_filament();
    /// From what is asked to where the planner goes.
    [[nodiscard]] motion::Correction& correction() { return correction_; }
    [[nodiscard]] const motion::Correction& correction() const { return correction_; }
    /// The planner's place as G-code counts it: in machine coordinates, without corrections.
    [[nodiscard]] motion::AxisVector asked_mm() const {
        return correction_.asked_of(planner().position_mm());
    }
    [[nodiscard]] StepScale& scale() { return scale_; }
    [[nodiscard]] const StepScale& scale() const { return scale_; }

    /// M201, M203, M204, M205, for what is appended from now on.
    void change_limits(const gcode::LimitChange& change);
    [[nodiscard]] const Accelerations& accelerations() const { return accelerations_; }
    /// M593, M900, M572, for what is appended from now on. Another advance holds in full motion;
    /// for any other change the motion stands still there. Contract: not away(), and the planner
    /// has room.
    void change_compensation(const gcode::CompensationChange& change);

    /// Everything that a job may change of how motion is made.
    struct Adjusted {
        motion::MotionSettings settings;
        Accelerations accelerations;
        Compensation compensation;
        motion::BedMesh mesh;
        bool uses_mesh = false;
        double fade_end_mm = 0;
        SkewConfig skew;
    };
    [[nodiscard]] Adjusted adjusted() const;
    /// Back to that, for what is appended from now on. Contract: not away(), and the planner has
    /// room, or a stop runs.
    void restore(const Adjusted& before);

    // ---- loops 1 and 2 --------------------------------------------------------------------------

    [[nodiscard]] Stops& stops() { return stops_; }

    // ---- loop 2 ---------------------------------------------------------------------------------

    [[nodiscard]] StepRing& ring() { return ring_; }
    /// The loops that read loop 2's counts: 1 and 3.
    [[nodiscard]] channel::Broadcast<link::MotionCounts, 2> readers() {
        return channel::Broadcast<link::MotionCounts, 2>{{&for_loop_1_, &for_loop_3_}};
    }

    // ---- loop 3 ---------------------------------------------------------------------------------

    /// Step pulses of all axes, ever.
    [[nodiscard]] std::uint64_t pulses() const {
        const auto each = for_loop_3_.read().pulses;
        return std::accumulate(each.begin(), each.end(), std::uint64_t{0});
    }

    /// Where the motor of E stands.
    [[nodiscard]] std::int64_t filament_steps() const { return for_loop_3_.read().steps[Axis::e]; }

  private:
    /// What has been solved, on the print's time line, which runs on where motion is dropped.
    struct Solved {
        std::int64_t until_ns = 0;
        std::int64_t began_ns = 0;  // the first event after everything before had been played
        bool idle = true;           // nothing has been solved since then
    };

    /// Places of the planner that one command may need.
    [[nodiscard]] std::size_t room_needed() const {
        return correction_.follows_bed() ? kSplitReserve : kPlannerReserve;
    }
    /// From where the player is, or, when it has not begun on this motion yet, from where it will
    /// begin.
    [[nodiscard]] Nanoseconds ahead() const {
        return Nanoseconds{solved_.until_ns - std::max(seen_.timeline_ns, solved_.began_ns)};
    }

    void append_filters();

    motion::Planner planner_;
    motion::Planner excursion_;
    bool away_ = false;
    step::Solver solver_;
    StepRing ring_;
    channel::FourSlot<link::MotionCounts> for_loop_1_;
    channel::FourSlot<link::MotionCounts> for_loop_3_;
    link::MotionCounts seen_;
    Solved solved_;
    Stops stops_;
    StepScale scale_;
    motion::Correction correction_;
    Accelerations accelerations_;
    Compensation compensation_;
};

}  // namespace qduino::printer::machine
