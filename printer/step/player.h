// The player, loop 2's body: turns step events into pulses on pins, each at its instant.
//
//   time line        e1         e2                  e3 (the other way)
//                    |          |                   |
//   STEP X   ________/‾‾\_______/‾‾\________________/‾‾\____
//                    |<>|<----->|  :                |         high and low: 1 µs each, at least
//   DIR X    ----------------------.''''''''''''''''''''''''  changes once the last old pulse
//                                  |<-- set-up ---->|         has ended: its 200 ns delay no step
//   STEP Y   ______________/‾‾\_____________________________  axes overlap freely
//                          |  |
//   actions          r  f  r  f r  f                r  f      the earlier of next rise, oldest fall
//
// Steps of several axes at one instant rise in one write of the pins, and fall in one: where the
// board can, their edges come together, and the second is not late by what the first one takes.
//
// Falls come due in the order of their rises, because all pulses are equally long: a queue of at
// most one per axis holds them. A pulse may be longer than asked, a step may not be late: so where
// both are overdue, the rise comes before falls of other axes, and those fall in one write.
//
// For directions the player looks ahead in the ring by up to kLookAhead events; each axis has at
// most one change of direction waiting.
//
// Lateness. The instant of an event is `anchor + event.time`. A step may be raised late, and
// catching up would put steps too close together. So a step that is late by more than
// `late_threshold` moves the anchor by its lateness: later steps keep their distance. (Below the
// threshold a distance may shrink by as much.) Every step's lateness goes into the histogram; the
// sum of what moved the time line is shift_ns.
//
// Running dry. When the ring was empty and the next event is due before now, the time line starts
// again `lead` after now. In motion (the last event was no rest) this is starvation: it is counted
// and added to shift_ns. At rest it is idleness.
//
// Homing. A homing event says which motors a switch ends: on a cartesian machine one, on CoreXY
// both belts, on a delta each tower's switch its own carriage, and a probe every motor that moves
// the nozzle. While the switch is watched, each step of the first of these motors reads it. Once it
// is pressed, their steps are dropped. (The first one alone: the others step with it, at the same
// instant or within a step of it, and so the steps of two belts stay in pairs.) The counters stay
// at the pulses sent, and so differ from the plan exactly when the switch was found. When all
// watched switches have been pressed, the player skips the remaining steps without waiting for
// their time. The switch in E's place is the probe.
//
// A template over the pins, so that the calls are direct on a board and in the simulator. Real-time
// safe: no heap, no locks. All methods are for loop 2 alone.
//
// It has more functions than other classes: one for each action on a pin and each rule above, short
// enough to be inlined into the one loop that calls them.
#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <cstdint>

#include "base/fixed_vector.h"
#include "base/time.h"
#include "printer/kinematics.h"
#include "printer/link/layout.h"
#include "printer/step/step_event.h"

namespace qduino::printer::step {

/// Motors whose pins are written together, in the order of their steps.
using MotorList = FixedVector<std::uint8_t, kAxisCount>;

/// What the player needs: a clock, and two outputs and a switch for each axis. `positive` is in
/// the motor's coordinates; the pins do the inversion, and drive every motor of an axis that has
/// several.
template <class P>
concept StepPins = requires(P& pins, Instant t, int axis, const MotorList& motors, bool on) {
    { pins.now() } -> std::same_as<Instant>;
    { pins.busy_until(t) } -> std::same_as<void>;          // never returns early
    { pins.set_steps(motors, on) } -> std::same_as<void>;  // in one write, where that can be
    { pins.set_direction(axis, on) } -> std::same_as<void>;
    // Where several motors of an axis have switches of their own, all of them must be pressed.
    { pins.endstop_pressed(axis) } -> std::same_as<bool>;
    // While on, a motor whose own switch is pressed gets no steps, whatever its axis does.
    { pins.watch_switches(axis, on) } -> std::same_as<void>;
};

struct PlayerSettings {
    Nanoseconds pulse = 1us;           ///< STEP high at least
    Nanoseconds low = 1us;             ///< STEP low at least
    Nanoseconds direction = 200ns;     ///< DIR unchanged before and after a rising edge, at least
    Nanoseconds late_threshold = 1us;  ///< lateness up to this does not move the time line
    Nanoseconds lead = 2ms;            ///< from the first event after running dry to its step
};

inline PlayerSettings player_settings(const MachineConfig& config) {
    return {.pulse = config.step_pulse, .low = config.step_low, .direction = config.direction_setup};
}

template <StepPins Pins, class Ring>
class Player {
  public:
    /// Both outlive the player. Sets every STEP low and every DIR positive.
    Player(Pins& pins, Ring& ring, const PlayerSettings& settings = {})
        : pins_(pins),
          ring_(ring),
          settings_(settings),
          // DIR may change when a pulse ends.
          pulse_ns_(to_ns(std::max(settings.pulse, settings.direction))) {
        const std::int64_t now = now_ns();
        MotorList all;
        for (int axis = 0; axis < kAxisCount; ++axis) all.push_back(static_cast<std::uint8_t>(axis));
        pins_.set_steps(all, false);
        for (int axis = 0; axis < kAxisCount; ++axis) {
            pins_.set_direction(axis, true);
            axes_[axis].rise_ns_min = now + std::max(to_ns(settings_.low), to_ns(settings_.direction));
        }
    }

    /// Does everything that is due before `horizon`, waiting for each instant. Returns when the
    /// next action is at `horizon` or after it; at once when there is nothing to do. Late by at
    /// most one action.
    void play_until(Instant horizon) { play_to_pause(horizon, horizon, {}); }
    /// Does everything that is due before `from`, as above, and goes on until nothing is due for
    /// `pause`, to `end` at most. Returns the next action's instant; kForever when there is none.
    Instant play_to_pause(Instant from, Instant end, Nanoseconds pause) {
        if (stopped_) {
            drop_all();
            return kForever;
        }
        const std::int64_t from_ns = to_ns(from), end_ns = to_ns(end), pause_ns = to_ns(pause);
        int skips_left = kSkipsPerCall;
        const auto goes_on = [&](std::int64_t due_ns) {
            return due_ns < from_ns || (due_ns < end_ns && due_ns - pause_ns < now_ns());
        };
        Due due = next();
        while (goes_on(due.first_ns()) && act(due, skips_left)) due = next();
        return instant_from_ns(due.first_ns());
    }

    /// The instant of the next action; kForever when there is none. For a caller that would rather
    /// sleep.
    [[nodiscard]] Instant next_due() { return stopped_ ? kForever : instant_from_ns(next().first_ns()); }

    /// Emergency: no pulse until allow_motion(). Ends a pulse that is high; drops all events, and
    /// those that are pushed later. The positions stay those of the pulses sent.
    void stop_now() {
        MotorList high;
        for (int axis = 0; axis < kAxisCount; ++axis)
            if (axes_[axis].high) high.push_back(static_cast<std::uint8_t>(axis));
        if (!high.empty()) pins_.set_steps(high, false);
        const std::int64_t ready_ns = now_ns() + std::max(to_ns(settings_.low), to_ns(settings_.direction));
        for (AxisState& axis : axes_) axis = {.rise_ns_min = ready_ns, .direction = axis.direction};
        falls_begin_ = falls_end_;
        for (int axis = 0; axis < kAxisCount; ++axis) switch_homing(axis, 0);
        status_.moving = false;
        stopped_ = true;
        drop_all();
    }

    [[nodiscard]] bool stopped() const { return stopped_; }
    /// After stop_now(): plays what is pushed from now on, and drops what was pushed before. The
    /// feeder must have started afresh from steps() (Planner::reset, Solver::reset).
    void allow_motion() {
        if (!stopped_) return;
        drop_all();
        stopped_ = false;
    }

    /// Brings the status up to date and counts the heartbeat. Valid until the next call of any
    /// method. It is 5 KB to copy, its MotionCounts alone are small. `stops_served`: the caller's.
    [[nodiscard]] const link::MotionStatus& publish(std::uint32_t stops_served = 0) {
        ++status_.heartbeat;
        status_.stops_served = stops_served;
        status_.events_taken = ring_.popped();
        status_.ring_fill = static_cast<std::uint32_t>(ring_.size());
        status_.timeline_ns = timeline_ns();
        return status_;
    }

    /// Steps dropped because an endstop was pressed, ever.
    [[nodiscard]] std::uint64_t steps_dropped() const { return steps_dropped_; }
    /// Microsteps per axis, counted from the pulses sent.
    [[nodiscard]] const PerAxis<std::int64_t>& steps() const { return status_.steps; }
    [[nodiscard]] bool moving() const { return status_.moving; }
    /// The last marker played; 0 before the first.
    [[nodiscard]] std::uint32_t last_marker() const { return status_.last_marker; }
    /// How often each endstop has ended a homing run.
    [[nodiscard]] const PerAxis<std::uint32_t>& endstop_hits() const { return status_.endstop_hits; }
    /// How far the print's own time line has been played. Between two events it runs on with the
    /// board's time; it stands still while the ring is empty.
    [[nodiscard]] std::int64_t timeline_ns() {
        const StepEvent* next = ring_.front();
        if (!next || dry_) return played_ns_;  // dry: the anchor may be of a motion long past
        return std::clamp(now_ns() - anchor_ns_, played_ns_, std::max(played_ns_, next->time_ns));
    }

  private:
    static constexpr std::size_t kLookAhead = 8;
    static constexpr int kSkipsPerCall = 1024;
    static constexpr std::int64_t kNever = to_ns(kForever);

    struct AxisState {
        // Low time after the last pulse, set-up after the last change of DIR.
        std::int64_t rise_ns_min = 0;
        std::uint32_t seen = 0;              // steps looked at and not yet played
        std::uint32_t seen_before_turn = 0;  // … of them before the waiting change of direction
        std::int8_t direction = 1;           // on the pin
        bool high = false;
        bool turning = false;  // a change of direction waits
    };
    struct Fall {
        std::int64_t due_ns = 0;
        MotorList motors;
    };

    [[nodiscard]] std::int64_t now_ns() { return to_ns(pins_.now()); }
    void wait_until(std::int64_t ns) { pins_.busy_until(instant_from_ns(ns)); }

    // ---- the next action ------------------------------------------------------------------------

    struct Due {
        std::int64_t event_ns = 0, fall_ns = 0;  // kNever: there is none
        [[nodiscard]] std::int64_t first_ns() const { return std::min(event_ns, fall_ns); }
    };
    [[nodiscard]] Due next() {
        const std::int64_t event_ns = next_event_ns();
        return {event_ns, next_fall_ns()};
    }
    /// Does it, at its instant. False: too many steps were skipped in one call.
    bool act(const Due& due, int& skips_left) {
        if (due.fall_ns <= due.event_ns && !rises_first(due.event_ns)) {
            wait_until(due.fall_ns);
            end_due_pulses();
        } else if (const StepEvent event = *ring_.front(); skips(event)) {
            if (skips_left-- == 0) return false;
            skip(event);
        } else {
            wait_until(due.event_ns);
            play(event, due.event_ns);
        }
        return true;
    }

    [[nodiscard]] std::int64_t next_fall_ns() const {
        return falls_begin_ == falls_end_ ? kNever : falls_[falls_begin_ % kAxisCount].due_ns;
    }

    /// When the event at the front may be played: at its time on the time line, or later, when its
    /// axis is ready for it.
    [[nodiscard]] std::int64_t next_event_ns() {
        const StepEvent* event = ring_.front();
        if (!event) {
            dry_ = true;
            return kNever;
        }
        if (dry_) restart_if_late(*event);
        look_ahead();
        const std::int64_t due_ns = anchor_ns_ + event->time_ns;
        if (event->kind != EventKind::step) return due_ns;
        if (skips(*event)) return std::min(due_ns, now_ns());
        return std::max(due_ns, axes_[event->axis].rise_ns_min);
    }

    void restart_if_late(const StepEvent& event) {
        dry_ = false;
        const std::int64_t now = now_ns();
        const std::int64_t late_ns = now - (anchor_ns_ + event.time_ns);
        if (started_ && late_ns <= to_ns(settings_.late_threshold)) return;
        if (status_.moving) {
            ++status_.starved;
            status_.shift_ns += late_ns + to_ns(settings_.lead);
        }
        anchor_ns_ = now + to_ns(settings_.lead) - event.time_ns;
        started_ = true;
    }

    /// The event at the front is due already, and need not wait for the end of a pulse.
    [[nodiscard]] bool rises_first(std::int64_t event_ns) {
        return event_ns != kNever && !axes_[ring_.front()->axis].high && event_ns <= now_ns();
    }

    // ---- looking ahead --------------------------------------------------------------------------

    void look_ahead() {
        while (looked_ < kLookAhead) {
            const StepEvent* event = ring_.peek(looked_);
            if (!event || (event->kind == EventKind::step && !look_at(*event))) return;
            ++looked_;
        }
    }

    /// False when the step needs a change of direction behind another that still waits: look again
    /// later.
    [[nodiscard]] bool look_at(const StepEvent& event) {
        AxisState& axis = axes_[event.axis];
        const int direction_before = axis.turning ? -axis.direction : axis.direction;
        if (event.direction != direction_before) {
            if (axis.turning) return false;
            axis.turning = true;
            axis.seen_before_turn = axis.seen;
            if (axis.seen == 0 && !axis.high) turn(event.axis);
        }
        ++axis.seen;
        return true;
    }

    void turn(int axis) {
        AxisState& state = axes_[axis];
        state.turning = false;
        state.direction = static_cast<std::int8_t>(-state.direction);
        pins_.set_direction(axis, state.direction > 0);
        state.rise_ns_min = std::max(state.rise_ns_min, now_ns() + to_ns(settings_.direction));
    }

    // ---- playing --------------------------------------------------------------------------------

    /// `due_ns`: when it may be played.
    void play(const StepEvent& event, std::int64_t due_ns) {
        ring_.pop();
        --looked_;
        played_ns_ = event.time_ns;
        switch (event.kind) {
            case EventKind::step:
                play_step(event, due_ns);
                break;
            case EventKind::marker:
                status_.last_marker = event.value;
                break;
            case EventKind::homing:
                switch_homing(event.axis, event.value);
                break;
            case EventKind::rest:
                status_.moving = false;
                break;
        }
    }

    void play_step(const StepEvent& event, std::int64_t due_ns) {
        status_.moving = true;
        if (endstop_ends(event.axis)) {
            drop_step(event.axis);
            return;
        }
        MotorList motors;
        add(event, motors);
        if (homing_ == 0) [[likely]]
            gather(event.time_ns, due_ns, motors);
        raise(motors, anchor_ns_ + event.time_ns);
    }
    void add(const StepEvent& event, MotorList& motors) {
        AxisState& axis = axes_[event.axis];
        --axis.seen;
        if (axis.turning) --axis.seen_before_turn;
        axis.high = true;
        status_.steps[event.axis] += event.direction;
        ++status_.pulses[event.axis];
        motors.push_back(event.axis);
    }
    /// The steps behind the first that have its time, as far as their axes are ready at `due_ns`
    /// and they have been looked at.
    void gather(std::int64_t time_ns, std::int64_t due_ns, MotorList& motors) {
        while (looked_ > 0) {
            const StepEvent* next = ring_.front();
            if (next->time_ns != time_ns || next->kind != EventKind::step) return;
            const AxisState& axis = axes_[next->axis];
            if (axis.high || axis.rise_ns_min > due_ns) return;
            add(*next, motors);
            ring_.pop();
            --looked_;
        }
    }

    void raise(const MotorList& motors, std::int64_t due_ns) {
        pins_.set_steps(motors, true);
        const std::int64_t now = now_ns();
        falls_[falls_end_++ % kAxisCount] = {now + pulse_ns_, motors};
        for (const int axis : motors) {
            axes_[axis].rise_ns_min = now + pulse_ns_ + to_ns(settings_.low);
            // The first that is late moves the time line, for all of them.
            due_ns += settle_lateness(now - due_ns);
        }
    }

    /// Returns by how much it moved the time line.
    std::int64_t settle_lateness(std::int64_t lateness_ns) {
        status_.lateness_ns.record(lateness_ns);
        if (lateness_ns <= to_ns(settings_.late_threshold)) return 0;
        ++status_.late_steps;
        status_.shift_ns += lateness_ns;
        anchor_ns_ += lateness_ns;
        return lateness_ns;
    }

    /// The oldest pulse, and the others that are due.
    void end_due_pulses() {
        MotorList motors = falls_[falls_begin_++ % kAxisCount].motors;
        for (; falls_begin_ != falls_end_ && next_fall_ns() <= now_ns(); ++falls_begin_)
            for (const std::uint8_t axis : falls_[falls_begin_ % kAxisCount].motors) motors.push_back(axis);
        pins_.set_steps(motors, false);
        const std::int64_t ready_ns = now_ns() + to_ns(settings_.low);
        for (const int axis : motors) {
            AxisState& state = axes_[axis];
            state.high = false;
            state.rise_ns_min = ready_ns;
            if (state.turning && state.seen_before_turn == 0) turn(axis);
        }
    }

    // ---- homing ---------------------------------------------------------------------------------

    void switch_homing(int axis, MotorMask motors) {
        const unsigned bit = 1u << axis;
        homing_ = motors != 0 ? homing_ | bit : homing_ & ~bit;
        pressed_ &= ~bit;
        if (motors_of_[axis] != motors) pins_.watch_switches(axis, motors != 0);
        motors_of_[axis] = motors;
        ended_ = 0;
        for (int each = 0; each < kAxisCount; ++each)
            if ((pressed_ >> each & 1u) != 0) ended_ |= motors_of_[each];
    }

    [[nodiscard]] bool endstop_ends(int motor) {
        const unsigned bit = 1u << motor;
        if (homing_ == 0) [[likely]]
            return false;
        for (int axis = 0; axis < kAxisCount; ++axis) {
            const bool is_first = (motors_of_[axis] & (2 * bit - 1)) == bit;
            if (is_first && (pressed_ >> axis & 1u) == 0 && pins_.endstop_pressed(axis)) press(axis);
        }
        return (ended_ & bit) != 0;
    }
    void press(int axis) {
        pressed_ |= 1u << axis;
        ended_ |= motors_of_[axis];
        ++status_.endstop_hits[axis];
    }

    void drop_step(int axis) {
        AxisState& state = axes_[axis];
        ++steps_dropped_;
        --state.seen;
        if (!state.turning) return;
        --state.seen_before_turn;
        if (state.seen_before_turn == 0 && !state.high) turn(axis);
    }

    /// True for a step that will be dropped, so that the player need not wait for it.
    [[nodiscard]] bool skips(const StepEvent& event) const {
        return homing_ != 0 && pressed_ == homing_ && event.kind == EventKind::step &&
               (ended_ >> event.axis & 1u) != 0 && falls_begin_ == falls_end_;
    }

    /// Drops the step at the front now; the time line comes forward with it.
    void skip(const StepEvent& event) {
        anchor_ns_ = std::min(anchor_ns_, now_ns() - event.time_ns);
        ring_.pop();
        --looked_;
        played_ns_ = event.time_ns;
        drop_step(event.axis);
    }

    // ---- stop and status ------------------------------------------------------------------------

    void drop_all() {
        ring_.discard_all();
        // The copy of the writer's counter may be older than what was just dropped.
        ring_.adopt_reader();
        looked_ = 0;
        started_ = false;
        dry_ = true;
    }

    Pins& pins_;
    Ring& ring_;
    const PlayerSettings settings_;
    const std::int64_t pulse_ns_;  // of STEP
    std::array<AxisState, kAxisCount> axes_{};
    std::array<Fall, kAxisCount> falls_{};  // ring of at most one per axis, oldest at falls_begin_
    std::uint32_t falls_begin_ = 0;
    std::uint32_t falls_end_ = 0;
    std::size_t looked_ = 0;                         // events looked at, from the front of the ring
    std::int64_t anchor_ns_ = 0;                     // board time of 0 on the time line
    std::int64_t played_ns_ = 0;                     // on the time line: the last event taken
    bool stopped_ = false;                           // by stop_now(): nothing is played
    bool started_ = false;                           // the anchor means something
    bool dry_ = true;                                // the ring was empty since the last event
    unsigned homing_ = 0;                            // bit per switch that is watched
    unsigned pressed_ = 0;                           // … and has been pressed since
    std::array<MotorMask, kAxisCount> motors_of_{};  // … and ends these motors
    MotorMask ended_ = 0;
    std::uint64_t steps_dropped_ = 0;
    link::MotionStatus status_;
};

}  // namespace qduino::printer::step
