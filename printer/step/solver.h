// From motion to steps: when, to the nanosecond, does each motor cross from one microstep to the
// next?
//
// A motor's count is its position rounded to whole microsteps; it changes where the position
// crosses a half-step, (k + ½)/steps_per_mm. Within one segment a motor moves in proportion to the
// distance along the path. So the crossings are evenly spaced in distance, and the trapezoid's own
// quadratic turns each into a time (trapezoid.h):
//
//   motor   ^                         .--- end
//           |  k+5/2 - - - - - - -.-'
//           |  k+3/2 - - - -  .-'  :           each axis by itself; the four streams of instants
//           |  k+1/2 -  - _.-'  :  :           are merged in order of time, ties in order of axis
//           |  start --''  :    :  :
//           +--------------+----+--+---> time
//                          *    *  *
//
// From segment to segment the solver carries the whole count of each motor. The number of steps in
// a segment follows from where the segment ends. So no error adds up: after any number of moves the
// count is the end position, rounded.
//
// Turning back. A motor that turns just behind a half-step crosses it twice, as near in time as one
// likes. The driver chip takes no such pair of pulses, and the pair moves nothing, so it is left
// out. To see the pair, the solver keeps the events in the last gap (`step_interval_min`) of what
// it knows in a short queue (the tail) until it knows the next segment:
//
//        known: segment n            segment n+1
//   -----------------------|gap|---------------------->    dropped: a step in the tail, and the
//    given out at once     |tail                           first step of n+1, if it is nearer than
//                                                          the gap and goes the other way
//
// When nothing follows, drain() lets the tail go. If the next motion then begins backward within
// the gap, its step is delayed to the legal spacing instead. No event is ever reordered.
//
// Pure, no heap. The budget of solve_some() bounds its time: well below 100 ns an event.
//
// It has more members than other classes: two segments, the tail between them and the limits of
// four motors are all that it knows of the motion.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "printer/motion/segment.h"
#include "printer/step/step_event.h"

namespace qduino::printer::step {

class Solver {
  public:
    /// At rest at `position_mm`. Of the settings: the steps per millimetre, and the shortest time
    /// between two rising edges of one axis. Steps there and back nearer than that are left out.
    explicit Solver(const motion::MotionSettings& settings, const motion::AxisVector& position_mm = {});

    /// True when the segment loaded last is solved: load() the next, or drain() when there is none.
    [[nodiscard]] bool wants_segment() const { return !solving_ && !tail_is_filled(); }
    /// Takes the next segment, in the planner's order. Contract: wants_segment().
    void load(const motion::Segment& segment);
    /// Call when nothing follows for a while: solve_some() then releases what is kept back. Ends
    /// with the next load().
    void drain() { draining_ = true; }

    /// Gives at most `events_max` events to `sink(const StepEvent&)`, in order of time, and returns
    /// how many. If fewer than asked for: wants_segment().
    template <class Sink>
    std::size_t solve_some(std::size_t events_max, Sink&& sink) {
        std::size_t given = 0;
        while (given < events_max) {
            if (tail_may_go()) {
                sink(tail_[tail_begin_++ % kTailCapacity]);
                ++given;
                continue;
            }
            if (!solving_) break;
            const int axis = earliest_axis();
            if (next_ns_[axis] == kNever) {
                solving_ = false;
                if (ends_at_rest_) keep_event(EventKind::rest, 0, 0);
                continue;
            }
            const StepEvent event = take_step(axis);
            if (tail_begin_ == tail_end_ && event.time_ns + interval_ns_ <= end_ns_) {
                sink(event);
                ++given;
            } else {
                keep(event);
            }
        }
        return given;
    }

    /// Drops everything and is at rest at `position_mm`. The next segment may begin anywhere on the
    /// time line.
    void reset(const motion::AxisVector& position_mm);

    /// Microsteps per axis at the end of the segment loaded last.
    [[nodiscard]] const std::array<std::int64_t, kAxisCount>& counts() const { return counts_; }
    /// Pairs of steps there and back that were left out.
    [[nodiscard]] std::uint64_t pairs_dropped() const { return pairs_dropped_; }
    /// Steps moved in time to keep the legal spacing.
    [[nodiscard]] std::uint64_t steps_delayed() const { return steps_delayed_; }
    /// Events kept back at the moment.
    [[nodiscard]] std::size_t tail_size() const { return tail_end_ - tail_begin_; }

  private:
    static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();
    static constexpr std::size_t kTailCapacity = 64;
    // The most that load() itself may put into the tail.
    static constexpr std::size_t kEventsPerLoad = 8;

    /// The crossings of one motor in the segment being solved: evenly spaced in distance.
    struct Track {
        double first_mm = 0;    // path distance of crossing 0
        double stride_mm = 0;   // … from one crossing to the next
        std::int64_t done = 0;  // crossings found
        std::int64_t total = 0;
        std::int8_t direction = 1;
    };

    void load_move(const motion::Segment& segment);
    void load_track(int axis, double start_steps, double end_steps);
    void drop_reversal(int axis);
    void find_next(int axis) {
        const Track& track = tracks_[axis];
        if (track.done == track.total) {
            next_ns_[axis] = kNever;
            return;
        }
        const double distance_mm = track.first_mm + static_cast<double>(track.done) * track.stride_mm;
        std::int64_t ns = start_.ns_after(shape_.time_at(distance_mm));
        if (ns < last_ns_[axis] + interval_ns_) [[unlikely]] {
            ns = last_ns_[axis] + interval_ns_;
            ++steps_delayed_;
        }
        next_ns_[axis] = ns;
    }
    [[nodiscard]] int earliest_axis() const {
        const int xy = next_ns_[1] < next_ns_[0] ? 1 : 0;
        const int ze = next_ns_[3] < next_ns_[2] ? 3 : 2;
        return next_ns_[ze] < next_ns_[xy] ? ze : xy;
    }
    [[nodiscard]] StepEvent take_step(int axis) {
        Track& track = tracks_[axis];
        last_event_ns_ = std::max(last_event_ns_, next_ns_[axis]);
        before_last_ns_[axis] = last_ns_[axis];
        last_ns_[axis] = last_event_ns_;
        ++track.done;
        find_next(axis);
        return {last_event_ns_, EventKind::step, static_cast<std::uint8_t>(axis), track.direction, 0, 0};
    }
    void keep(const StepEvent& event) { tail_[tail_end_++ % kTailCapacity] = event; }
    void keep_event(EventKind kind, int axis, std::uint32_t value);
    [[nodiscard]] bool tail_is_filled() const { return tail_size() + kEventsPerLoad > kTailCapacity; }
    [[nodiscard]] bool tail_may_go() const {
        if (tail_begin_ == tail_end_) return false;
        const std::int64_t oldest_ns = tail_[tail_begin_ % kTailCapacity].time_ns;
        return oldest_ns + interval_ns_ <= end_ns_ || draining_ || tail_is_filled();
    }

    PerAxis<double> steps_per_mm_;
    std::int64_t interval_ns_;
    std::array<std::int64_t, kAxisCount> counts_{};
    std::array<std::int64_t, kAxisCount> last_ns_{};         // the latest step of each axis
    std::array<std::int64_t, kAxisCount> before_last_ns_{};  // … and at or after the one before it
    // The next step of each axis in the segment being solved; kNever: none.
    std::array<std::int64_t, kAxisCount> next_ns_{};
    std::array<Track, kAxisCount> tracks_{};
    motion::Trapezoid shape_;
    motion::TimelineInstant start_;
    std::int64_t end_ns_ = 0;         // the end of what is known
    std::int64_t last_event_ns_ = 0;  // of the latest event, kept or given: time never runs back
    bool solving_ = false;
    bool ends_at_rest_ = false;
    bool draining_ = false;
    std::array<StepEvent, kTailCapacity> tail_{};
    std::size_t tail_begin_ = 0;  // counts of entries ever taken out, and put in
    std::size_t tail_end_ = 0;
    std::uint64_t pairs_dropped_ = 0;
    std::uint64_t steps_delayed_ = 0;
};

}  // namespace qduino::printer::step
