// The crossings of all motors where the motion is filtered, or a motor does not move in proportion
// to the way: merged in order of time.
//
//   segments ─► MotionTrack ─► four MotorPaths ─► four CrossingSearches ─► the earliest crossing
//
// A filter looks into the future, so crossings are known up to some time before the end of the
// track. What is known of one motor is not known of all: a crossing is given out when no other
// motor may still have an earlier one.
//
// Standstills. A filtered motion begins before the planned one and ends after it:
//
//   planned         ___/‾‾‾‾‾‾\________________/‾‾‾‾        a planned standstill is one of
//   filtered     __.-'‾‾‾‾‾‾‾‾'-._ . . . . _.-'‾‾‾‾          the motors only as far as it is
//                |future|     |past|gap|                     longer than the filters reach
//
// Where the motors must really stand (a dwell, homing, other filters, nothing more to do), settle()
// adds a rest of that length. Each motor then stands at the whole step nearest to where the plan
// ends, whatever the sum of the shares was rounded to.
//
// The clock is in seconds from begin() on.
//
// Pure, no heap. 1 MB: give it static storage.
#pragma once

#include <array>
#include <cstdint>

#include "printer/step/crossing_search.h"
#include "printer/step/motor_path.h"

namespace qduino::printer::step {

class PathSolver {
  public:
    using Counts = std::array<std::int64_t, kAxisCount>;
    enum class Found : std::uint8_t {
        step,
        blocked,  ///< the next segment is needed
        settled,  ///< idle: every motor stands
    };
    struct Crossing {
        std::int64_t time_ns = 0;
        int motor = 0;
        int way = 1;
    };

    explicit PathSolver(const motion::MotionSettings& settings);

    /// Contract: idle().
    void set_filters(const motion::MotionFilters& filters);
    /// Nothing is to be solved, and nothing moves.
    [[nodiscard]] bool idle() const { return idle_; }
    [[nodiscard]] bool settling() const { return settling_; }
    void stop() { idle_ = true, settling_ = false; }

    /// A motion from rest at `at_mm`, planned to begin at `start`; the motors stand at `counts`.
    /// Contract: idle(), and the time line is free from `start` − future_ns() on.
    void begin(const motion::AxisVector& at_mm, const Counts& counts, const motion::TimelineInstant& start);
    /// The next move, planned to begin at `start`. Contract: begun, has_room(), not settling().
    void append(const motion::Segment& segment, const motion::TimelineInstant& start);
    [[nodiscard]] bool has_room();
    /// The motion rests at the end of what was appended, and longer than filters reach.
    void settle();

    [[nodiscard]] Found next(Crossing& found);
    /// Up to here all crossings have been given out. On the time line.
    [[nodiscard]] std::int64_t known_until_ns() const;

    [[nodiscard]] const Counts& counts() const { return counts_; }
    /// How long before the plan motors move, and how long behind it.
    [[nodiscard]] std::int64_t future_ns() const { return future_ns_; }
    [[nodiscard]] std::int64_t past_ns() const { return past_ns_; }

  private:
    static constexpr double kNever_s = 1e300;

    void find(std::size_t motor);
    void find_in_path(std::size_t motor);
    /// The motor whose next crossing is the earliest, ties in order of motor. (Without branches:
    /// which motor is next is as good as random.)
    [[nodiscard]] std::size_t earliest() const {
        const std::size_t xy = next_s_[1] < next_s_[0] ? 1 : 0;
        const std::size_t ze = next_s_[3] < next_s_[2] ? 3 : 2;
        return next_s_[ze] < next_s_[xy] ? ze : xy;
    }
    [[nodiscard]] Found finish(Crossing& found);
    [[nodiscard]] std::int64_t to_timeline_ns(double at_s) const { return zero_.ns_after(at_s); }

    motion::MotionSettings settings_;
    std::int64_t future_ns_ = 0;
    std::int64_t past_ns_ = 0;
    motion::TimelineInstant zero_;
    Counts counts_{};  // as of what was found
    bool idle_ = true;
    bool settling_ = false;
    bool more_ = false;  // the track has grown since the blocked motors were asked
    std::array<bool, kAxisCount> blocked_{};
    double blocked_until_s_ = kNever_s;  // the earliest place from which a motor is not known
    std::array<double, kAxisCount> next_s_{};
    std::array<int, kAxisCount> ways_{};
    std::array<MotorPath, kAxisCount> paths_;
    std::array<CrossingSearch, kAxisCount> searches_;
    MotionTrack track_;
};

}  // namespace qduino::printer::step
