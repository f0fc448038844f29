// From moves to the step ring, and back what came of them: planner, solver and ring as one thing that loop 1
// fills.
//
//   append ─► planner ─► solver ─► step ring ════► loop 2 (player)
//                                                    │
//   timeline, markers, step counts ◄── four-slot ────┘
//
// How far ahead: pump() solves until `kAhead` of the print's own time lies in the ring. Loop 1 runs every 100
// ms, so 2 s survive twenty of its releases; more would only make pause slower.
//
// When nothing more can be read (a dead service, a slow one, the end of a job) and less than `kFlushBelow`
// lies ahead, what the planner kept for a better corner speed is planned down to a standstill: the motion
// ends at rest, never in mid-air.
//
// Away from the path. While the path is held (a pause), depart() puts a second planner in the place of the first, which keeps
// what is behind the stop. The head may then go anywhere through the same solver and ring. come_back() puts the path's
// planner back: X, Y and Z must stand where they left, E counts on from where it left, whatever was pushed meanwhile.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>

#include "base/contract.h"
#include "channel/four_slot.h"
#include "channel/ring_buffer.h"
#include "printer/link/layout.h"
#include "printer/motion/planner.h"
#include "printer/step/solver.h"
#include "printer/step/step_event.h"

namespace qduino::printer::machine {

using StepRing = channel::RingBuffer<step::StepEvent, step::kStepRingCapacity>;

class MotionPipe {
  public:
    static constexpr Nanoseconds kAhead = 2s;
    static constexpr Nanoseconds kFlushBelow = 500ms;
    static constexpr std::size_t kEventsPerPump = 1 << 17;  // bounds loop 1's release: about 5 ms
    /// Room that any one command may need: an arc piece and its marker, and a homing order.
    static constexpr std::size_t kPlannerReserve = 8;

    /// `emergency` (the link's counter) stops loop 2 too, without asking loop 1.
    MotionPipe(const MachineConfig& config, const std::atomic<std::uint32_t>& emergency);

    // ---- loop 1 -------------------------------------------------------------------------------------------

    [[nodiscard]] bool has_room() const { return planner().free() >= kPlannerReserve; }
    /// Of the motion that is fed now: the path's, or while away the other.
    [[nodiscard]] motion::Planner& planner() { return away_ ? excursion_ : planner_; }
    [[nodiscard]] const motion::Planner& planner() const { return away_ ? excursion_ : planner_; }

    /// Leaves the path where it is held. Contract: not away, planner().stopped(), played_out().
    void depart();
    /// Where the path was left. Contract: departed.
    [[nodiscard]] const motion::AxisVector& left_at_mm() const { return planner_.held_position_mm(); }
    /// Back on the path, still held. Contract: departed, drained(), and X, Y, Z stand at left_at_mm().
    void come_back();

    /// Takes loop 2's freshest word. Once per release, before anything is decided.
    void observe() { seen_ = feedback_.read(); }
    [[nodiscard]] const link::MotionStatus& seen() const { return seen_; }

    /// Solves steps into the ring. `more_may_come`: input is at hand, so the planner may go on hoping.
    void pump(bool more_may_come);

    /// Everything handed to the solver has been played.
    [[nodiscard]] bool played_out() const;
    /// Everything appended has been played.
    [[nodiscard]] bool drained() const { return planner().empty() && played_out(); }

    /// Asks loop 2 to drop everything it has, at once. Nothing is pumped until it has done so.
    void request_stop();
    [[nodiscard]] bool stopping() const { return stop_asked() != seen_.stops_served; }
    /// After a stop: nothing is planned, on the path or away from it, the machine rests at `position_mm`. Contract: not stopping().
    void reset(const motion::AxisVector& position_mm);
    /// Where the pulses say the machine is, from what `origin` counts as zero.
    [[nodiscard]] motion::AxisVector position_of_pulses(
        const std::array<std::int64_t, kAxisCount>& origin) const;

    // ---- loop 2 -------------------------------------------------------------------------------------------

    [[nodiscard]] StepRing& ring() { return ring_; }
    /// Differs from the last one served: drop every step, now.
    [[nodiscard]] std::uint32_t stop_asked() const {
        return stop_asked_.load(std::memory_order_acquire) + emergency_.load(std::memory_order_acquire);
    }
    /// Where loop 2's word reaches loop 1.
    [[nodiscard]] channel::FourSlot<link::MotionStatus>& feedback() { return feedback_; }

  private:
    /// From where the player is, or, when it has not begun on this motion yet, from where it will begin.
    [[nodiscard]] Nanoseconds ahead() const {
        return Nanoseconds{solved_until_ns_ - std::max(seen_.timeline_ns, began_ns_)};
    }

    motion::AxisVector steps_per_mm_{};
    motion::Planner planner_;
    motion::Planner excursion_;
    bool away_ = false;
    step::Solver solver_;
    StepRing ring_;
    channel::FourSlot<link::MotionStatus> feedback_;
    link::MotionStatus seen_;
    std::atomic<std::uint32_t> stop_asked_{0};
    const std::atomic<std::uint32_t>& emergency_;
    // On the print's time line, which runs on where motion is dropped:
    std::int64_t solved_until_ns_ = 0;
    std::int64_t began_ns_ = 0;  // the first event after everything before had been played
    bool idle_ = true;           // nothing has been solved since then
};

}  // namespace qduino::printer::machine
