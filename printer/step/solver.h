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
// That way is taken for trapezoids on linear machines without filters. With an input shaper,
// pressure advance, a bounded jerk or another kinematics the crossings come from path_solver.h.
// Both give their steps to the same tail.
//
// Turning back. A motor that turns just behind a half-step crosses it twice, as near in time as one
// likes. The driver chip takes no such pair of pulses, and the pair moves nothing, so it is left
// out: every pair that is nearer than `reversal_gap`. To see the pair, the solver keeps the events
// in the last gap of what it knows in a queue (step_tail.h) until it knows more. When nothing
// follows, drain() lets it go. If the next motion then begins backward within the shortest legal
// time, its step is delayed to the legal spacing instead. No event is ever reordered.
//
// Pressure advance is a number of each move: a change of it holds from the next move on, exactly
// and in full motion. A change of the filters (a shaper, the smoothing time, advance at all) needs
// a standstill: the planner makes it (Planner::append_filters()), and here the filters run out.
// While they run out the time line goes on, so what follows is played that much later than planned.
//
// Pure, no heap; 1 MB. The budget of solve_some() bounds its time: well below 100 ns an event.
//
// It has more members than other classes: two segments, the tail between them and the limits of
// four motors are all that it knows of the motion.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "printer/motion/segment.h"
#include "printer/step/path_solver.h"
#include "printer/step/step_event.h"
#include "printer/step/step_tail.h"

namespace qduino::printer::step {

/// Markers on their way through the filters, in order of time.
class Markers {
  public:
    struct Marker {
        std::int64_t time_ns = 0;
        std::uint32_t value = 0;
    };
    [[nodiscard]] bool empty() const { return begin_ == end_; }
    [[nodiscard]] bool full() const { return end_ - begin_ == kCapacity; }
    [[nodiscard]] const Marker& front() const { return markers_[begin_ % kCapacity]; }
    void push(const Marker& marker) { markers_[end_++ % kCapacity] = marker; }
    void pop() { ++begin_; }
    void clear() { begin_ = end_; }

  private:
    static constexpr std::size_t kCapacity = 1024;
    std::array<Marker, kCapacity> markers_{};
    std::size_t begin_ = 0;
    std::size_t end_ = 0;
};

class Solver {
  public:
    /// Begins at rest at `position_mm`. It takes from the settings what concerns the motors, the
    /// filters, and the shortest time between two rising edges of one axis.
    explicit Solver(const motion::MotionSettings& settings, const motion::AxisVector& position_mm = {});

    /// True when the segment loaded last is solved as far as it can be: load() the next, or drain()
    /// when there is none.
    [[nodiscard]] bool wants_segment() {
        return !solving_ && !tail_.is_filled() && (path_.idle() || path_.has_room());
    }
    /// Takes the next segment, in the planner's order. Contract: wants_segment().
    void load(const motion::Segment& segment);
    /// Call when nothing follows for a while, and the motion rests: solve_some() then gives
    /// everything out that is kept back. Ends with the next load().
    void drain();

    /// Gives at most `events_max` events to `sink(const StepEvent&)`, in order of time, and returns
    /// how many. If fewer than asked for: wants_segment().
    template <class Sink>
    std::size_t solve_some(std::size_t events_max, Sink&& sink) {
        std::size_t given = 0;
        while (given < events_max) {
            if (tail_may_go()) {
                sink(tail_.front());
                tail_.pop();
                ++given;
                continue;
            }
            if (!solving_) break;
            if (!path_.idle()) {
                solve_path();
                continue;
            }
            const int axis = earliest_axis();
            if (next_ns_[axis] == kNever) {
                solving_ = false;
                if (ends_at_rest_) keep_event(EventKind::rest, 0, 0);
                continue;
            }
            const StepEvent event = take_step(axis);
            if (tail_.empty() && event.time_ns + gap_ns_ <= end_ns_) {
                sink(event);
                ++given;
            } else {
                tail_.push(event);
            }
        }
        return given;
    }

    /// Drops everything and is at rest at `position_mm`. The next segment may begin anywhere on the
    /// time line. The filters stay.
    void reset(const motion::AxisVector& position_mm);

    /// In force for what is solved now.
    [[nodiscard]] const motion::MotionFilters& filters() const { return filters_; }
    /// Microsteps per axis at the end of what was loaded; while filters run, of what was solved.
    [[nodiscard]] const std::array<std::int64_t, kAxisCount>& counts() const {
        return path_.idle() ? counts_ : path_.counts();
    }
    /// Pairs of steps there and back that were left out.
    [[nodiscard]] std::uint64_t pairs_dropped() const { return pairs_dropped_; }
    /// Steps moved in time to keep the legal spacing.
    [[nodiscard]] std::uint64_t steps_delayed() const { return steps_delayed_; }
    /// Everything that was loaded has been given out.
    [[nodiscard]] bool gave_all() const { return tail_.empty() && !solving_ && path_.idle(); }

  private:
    static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

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
    void load_path(const motion::Segment& segment);
    void load_event(const motion::Segment& segment);
    void solve_path();
    std::int64_t shift_to(std::int64_t begin_ns, std::int64_t free_from_ns);
    void take_crossing(const PathSolver::Crossing& crossing);
    void pass_markers(std::int64_t until_ns);
    void find_next(int axis) {
        const Track& track = tracks_[axis];
        if (track.done == track.total) {
            next_ns_[axis] = kNever;
            return;
        }
        std::int64_t ns = crossing_ns(track);
        if (ns < last_ns_[axis] + interval_ns_) [[unlikely]] {
            ns = last_ns_[axis] + interval_ns_;
            ++steps_delayed_;
        }
        next_ns_[axis] = ns;
    }
    [[nodiscard]] std::int64_t crossing_ns(const Track& track) const {
        return start_.ns_after(
            shape_.time_at(track.first_mm + static_cast<double>(track.done) * track.stride_mm));
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
    [[nodiscard]] bool drops_pair(int axis, int direction, std::int64_t time_ns);
    void keep_event(EventKind kind, int axis, std::uint32_t value);
    [[nodiscard]] bool tail_may_go() const {
        if (tail_.empty()) return false;
        return tail_.front().time_ns + gap_ns_ <= end_ns_ || draining_ || tail_.is_filled();
    }

    motion::MotionSettings settings_;
    motion::MotionFilters filters_;
    std::int64_t interval_ns_;
    std::int64_t gap_ns_;
    std::array<std::int64_t, kAxisCount> counts_{};
    std::array<std::int64_t, kAxisCount> last_ns_{};         // the latest step of each axis
    std::array<std::int64_t, kAxisCount> before_last_ns_{};  // … and at or after the one before it
    std::array<std::int8_t, kAxisCount> last_way_{};         // … its direction; 0: not known
    // The next step of each axis in the segment being solved; kNever: none.
    std::array<std::int64_t, kAxisCount> next_ns_{};
    std::array<Track, kAxisCount> tracks_{};
    motion::Trapezoid shape_;
    motion::TimelineInstant start_;
    std::int64_t end_ns_ = 0;         // the end of what is known
    std::int64_t last_event_ns_ = 0;  // of the latest event, kept or given: time never runs back
    std::int64_t shift_ns_ = 0;       // the time line is so far behind the plan
    // A motion without filters begins no earlier.
    std::int64_t filters_ran_until_ns_ = 0;
    bool solving_ = false;
    bool ends_at_rest_ = false;
    bool draining_ = false;
    StepTail tail_;
    std::uint64_t pairs_dropped_ = 0;
    std::uint64_t steps_delayed_ = 0;
    PathSolver path_;
    Markers markers_;         // of the motion that the path solver has
    motion::Segment behind_;  // to be carried out when the motors stand
    bool has_behind_ = false;
    bool drains_behind_ = false;  // … and then nothing follows for a while
};

}  // namespace qduino::printer::step
