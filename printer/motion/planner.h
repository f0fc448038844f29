// The look-ahead: takes moves in, and gives segments out whose speeds are the highest that all
// limits together allow.
//
// Nodes are the places where moves meet. Node i, where move i begins, has an upper bound V_i for
// the square of its speed (junction.h). g_i = 2·a_i·L_i is how much acceleration can change the
// square within move i. The planner wants the greatest w with
//
//      w_i <= V_i
//      w_i <= w_{i+1} + g_i        the move can brake
//      w_{i+1} <= w_i + g_i        the move can accelerate
//
// (With a bounded jerk the right-hand sides are what an S-curve can reach, s_curve.h: they grow
// with w as well, and all that follows holds.)
//
// One pass backward (braking) and one forward (accelerating) find them. But the end of the queue is
// a trouble: a standstill there is safe and makes every print crawl, since the next move may be on
// its way. A later move can only raise a speed, never lower it. So both passes are made twice: with
// the queue's end at rest, and with it as fast as the last move may be. Where the two agree, no
// later move can change the speed any more. Everything before that node is final, and only then is
// it released:
//
//   speed²                                   . . . hopeful: the end of the queue in full motion
//     ^      V  V       V                    ----- safe: the end of the queue at rest
//     |      /--.     /---. . . . . . .
//     |     /    '---'     '-.
//     |    /                  '-.
//     +---'----------------------'---> nodes
//         |<-- released -->|<-- kept: more may come
//
// Very short moves may all be uncertain, as many as there are places. A reader that has no room for
// what follows waits for room, and the speeds wait for what follows: for ever. So the queue counts
// as full when its reader has no room left (`room` of next()), and a full queue releases the oldest
// move at its safe speed. A curve of such moves is then as fast as the whole queue can brake.
//
// Dwells, markers and the rest pass through the same queue, in order, as entries of no length. A
// marker does not affect the speed (V is the nominal speed of the move before it, g = 0). At the
// others the machine stands still (V = 0).
//
// The result does not depend on when next() is called, provided that the queue is emptied as far as
// it goes whenever it is full, for the same `room`, and that flush() is called at the same places.
//
// Pure; no heap; not for use from two loops. About 100 KB: give it static storage.
//
// It has more functions than other classes: each pass and each kind of entry has a short one, and
// all work on the one queue.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "printer/motion/junction.h"
#include "printer/motion/segment.h"

namespace qduino::printer::motion {

class Planner {
  public:
    static constexpr std::size_t kCapacity = 512;

    /// At rest at `position_mm`, at 0 on the time line.
    explicit Planner(const MotionSettings& settings, const AxisVector& position_mm = {});

    /// Limits for everything that is appended from now on.
    void set_settings(const MotionSettings& settings) { settings_ = settings; }
    [[nodiscard]] const MotionSettings& settings() const { return settings_; }

    // ---- in: each returns false, and changes nothing, when the queue is full --------------------

    /// Contract: the move's numbers are finite and its acceleration is above 0.
    [[nodiscard]] bool append(const Move& move);
    /// The same to an absolute place, E too: E then ends at that very number and not at a sum.
    [[nodiscard]] bool append_to(const AxisVector& end_mm, double speed_mm_s, double acceleration_mm_s2);
    /// How long `move` takes at its speed within the limits, without ramps. Contract: as append().
    [[nodiscard]] double nominal_s(const Move& move) const;
    /// … all moves that were ever appended, together.
    [[nodiscard]] double appended_s() const { return appended_s_; }
    /// Stands still for `duration_s` >= 0.
    [[nodiscard]] bool append_dwell(double duration_s);
    /// The player reports `value` when it has played everything before. Does not slow the motion.
    [[nodiscard]] bool append_marker(std::uint32_t value);
    /// From here on the switch of `axis` ends the steps of `motors` when it is pressed
    /// (step/player.h). 0: of none any more.
    [[nodiscard]] bool append_homing(Axis axis, MotorMask motors);
    /// `filters` are in force behind everything so far. Stands still there.
    [[nodiscard]] bool append_filters(const MotionFilters& filters);

    /// Call when nothing may follow for a while: plans everything appended so far down to a
    /// standstill, and releases it.
    void flush() { end_at_rest_ = dirty_ = true; }

    // ---- out ------------------------------------------------------------------------------------

    /// False, and `out` unchanged, when no segment is final yet and `room` places are free: the
    /// caller can append something first.
    [[nodiscard]] bool next(Segment& out, std::size_t room = 1);

    // ---- pause and cancel -----------------------------------------------------------------------

    /// Comes to rest at the earliest end of a move where it still can, and keeps the moves behind
    /// it.
    void hold();
    [[nodiscard]] bool held() const { return held_; }
    /// True when held, and everything before the stop has been handed out.
    [[nodiscard]] bool stopped() const { return held_ && head_ == hold_; }
    /// The place of the stop. Contract: held().
    [[nodiscard]] const AxisVector& held_position_mm() const;
    /// Moves the time line on to `at`: another planner's motion took place meanwhile. Contract:
    /// stopped(), and not back.
    void wait_until(const TimelineInstant& at);
    /// Goes on from the stop.
    void resume();
    /// Forgets everything behind the stop, and the hold. The position is that of the stop.
    /// Contract: held().
    void discard_held();
    /// Forgets everything at once and is at rest at `position_mm`. For emergency stops: the player
    /// must stop, too.
    void reset(const AxisVector& position_mm) { reset(position_mm, clock_); }
    /// The same, and goes on at `at` on the time line: where the player was stopped, say, which is
    /// before what was handed out.
    void reset(const AxisVector& position_mm, const TimelineInstant& at);

    // ---- state ----------------------------------------------------------------------------------

    /// The machine's position after everything that has been appended.
    [[nodiscard]] const AxisVector& position_mm() const { return position_mm_; }
    /// The end of the time line that is planned and handed out.
    [[nodiscard]] const TimelineInstant& released_until() const { return clock_; }
    [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>(tail_ - head_); }
    [[nodiscard]] bool empty() const { return size() == 0; }
    [[nodiscard]] bool full() const { return size() == kCapacity; }
    [[nodiscard]] std::size_t free() const { return kCapacity - size(); }
    /// True when the segments handed out end at rest, and no more can be handed out for now: empty,
    /// or held.
    [[nodiscard]] bool resting() const { return head_ == plan_end() && entry_speed_mm_s_ == 0; }

  private:
    /// The planning of one entry; squares of speeds in mm²/s².
    struct Node {
        double limit2 = 0;  ///< V: bound of the speed at which the entry begins
        double gain2 = 0;   ///< g = 2·a·L
        double acceleration_mm_s2 = 0;
        double jerk_mm_s3 = 0;  ///< 0: unlimited
        double safe2 = 0;       ///< backward pass with the queue's end at rest
        double hopeful2 = 0;    ///< … and in full motion
        double exit2 = 0;       ///< planned, where the entry ends
    };
    struct Entry {
        Segment segment;  ///< its times and shape are worked out when it is handed out
        double dwell_s = 0;
        MoveGeometry geometry;
    };

    /// How far along X, Y and Z, or along E when nothing else moves.
    struct Way {
        double length_mm = 0;
        bool extrude_only = false;
    };
    [[nodiscard]] static Way way_of(const AxisVector& delta_mm);
    [[nodiscard]] AxisVector end_of(const Move& move) const;
    /// The largest square at one end of `node` when the other end has `speed2`.
    [[nodiscard]] static double reach2(const Node& node, double speed2);
    Node& node(std::uint64_t number) { return nodes_[number % kCapacity]; }
    Entry& entry(std::uint64_t number) { return entries_[number % kCapacity]; }
    [[nodiscard]] MoveGeometry geometry_of(const AxisVector& end_mm, double length_mm, double speed_mm_s,
                                           double acceleration_mm_s2) const;
    Entry& push(SegmentKind kind, const Node& planned);
    [[nodiscard]] bool push_standstill(SegmentKind kind, Axis axis, std::uint32_t value, double dwell_s);
    [[nodiscard]] std::uint64_t plan_end() const { return held_ ? hold_ : tail_; }
    void plan();
    void plan_backward(std::uint64_t end);
    void plan_forward(std::uint64_t end);
    [[nodiscard]] std::uint64_t earliest_stop();
    void release(Segment& out);

    MotionSettings settings_;
    AxisVector position_mm_{};
    double appended_s_ = 0;
    TimelineInstant clock_;
    double entry_speed_mm_s_ = 0;  // of the head: the exit of what was handed out last
    double entry2_ = 0;            // its square, as planned
    std::uint64_t head_ = 0;       // entries ever handed out
    std::uint64_t ready_ = 0;      // … final: head <= ready <= tail
    std::uint64_t tail_ = 0;       // … appended
    std::uint64_t hold_ = 0;       // while held: the first entry kept back
    bool held_ = false;
    bool dirty_ = false;       // appended, held or flushed since the last plan()
    bool end_at_rest_ = true;  // what is at the tail stops there, whatever follows
    MoveGeometry last_move_;   // the geometry of the last move appended
    std::array<Node, kCapacity> nodes_{};
    std::array<Entry, kCapacity> entries_{};
};

}  // namespace qduino::printer::motion
