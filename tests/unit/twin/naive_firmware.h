// A firmware as simple as can be, for the tests of the inspector: it walks along each piece in
// small samples and steps every axis to the whole step nearest to where it should be. Brute force
// and no algebra, so that it shares no idea with the inspector, which solves for crossings.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "tests/unit/twin/text_source.h"
#include "twin/inspector.h"
#include "twin/machine.h"

namespace qduino::twin::testing {

struct Event {
    enum class Kind : std::uint8_t { step, closes, opens };
    Kind kind = Kind::step;
    std::int64_t time_ns = 0;
    int axis = 0;
    int direction = 0;
};

class NaiveFirmware {
  public:
    static constexpr int kSamplesPerStep = 32;

    explicit NaiveFirmware(const Machine& machine) : machine_(machine) {
        for (std::size_t axis = 0; axis < kAxisCount; ++axis)
            start_[axis] = absolute_[axis] =
                std::llround(machine.axes[axis].start_mm * machine.axes[axis].steps_per_mm);
        for (std::size_t axis = 0; axis < kSlideCount; ++axis)
            pressed_[axis] = absolute_[axis] <= trigger(axis);
        start_pressed_ = pressed_;
    }

    void move_to(const Position& to_mm) {
        double most = 1;
        for (std::size_t axis = 0; axis < kAxisCount; ++axis)
            most = std::max(most, std::abs(to_mm[axis] - at_mm_[axis]) * steps_per_mm(axis));
        const int samples = static_cast<int>(std::ceil(most)) * kSamplesPerStep;
        for (int sample = 1; sample <= samples; ++sample) {
            const double share = static_cast<double>(sample) / samples;
            time_ns_ += 1000;
            for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
                const double mm =
                    sample == samples ? to_mm[axis] : at_mm_[axis] + share * (to_mm[axis] - at_mm_[axis]);
                step_to(axis, static_cast<std::int64_t>(std::floor(mm * steps_per_mm(axis) + 0.5)));
            }
        }
        at_mm_ = to_mm;
    }

    /// An arc in XY about the centre by `sweep` radians, as chords that leave it by `chord_mm`; Z
    /// and E go evenly to `to`.
    void arc_to(const Position& to, double centre_x, double centre_y, double sweep, double chord_mm) {
        const Position from = at_mm_;
        const double radius = std::hypot(from[0] - centre_x, from[1] - centre_y);
        const double begin = std::atan2(from[1] - centre_y, from[0] - centre_x);
        const int chords =
            static_cast<int>(std::ceil(std::abs(sweep) / (2 * std::acos(1 - chord_mm / radius))));
        for (int chord = 1; chord <= chords; ++chord) {
            const double share = static_cast<double>(chord) / chords;
            Position at = to;
            for (std::size_t axis = 2; axis < kAxisCount; ++axis)
                at[axis] = from[axis] + share * (to[axis] - from[axis]);
            at[0] = centre_x + radius * std::cos(begin + share * sweep);
            at[1] = centre_y + radius * std::sin(begin + share * sweep);
            move_to(chord == chords ? to : at);
        }
    }

    /// Fast approach, retreat, slow approach, rest: each with a pause, as the planner of a real one
    /// makes.
    void home(const std::vector<int>& axes) {
        for (const int a : axes) {
            const auto axis = static_cast<std::size_t>(a);
            approach(axis, 25'000);
            time_ns_ += 70'000'000;
            const auto retreat = static_cast<int>(steps_per_mm(axis) * (axis == 2 ? 1 : 3));
            for (int i = 0; i < retreat; ++i) tick(axis, 1, 25'000);
            time_ns_ += 30'000'000;
            approach(axis, 1'500'000);
            time_ns_ += 50'000'000;
            steps_[axis] = 0;
            at_mm_[axis] = 0;
        }
    }
    void dwell(std::int64_t ns) { time_ns_ += ns; }

    /// As a paused machine: rests, leaves the path by `away` microsteps (X, Y, Z not below 0),
    /// rests, comes back with X, Y, Z to the very step, and rests. E stays `away[E]` beside: the
    /// firmware counts it on from where it left. Returns the first event of the way back.
    std::size_t excursion(const std::array<int, kAxisCount>& away) {
        dwell(100'000'000);
        for (const int axis : {3, 2, 0, 1})
            walk(static_cast<std::size_t>(axis), away[static_cast<std::size_t>(axis)]);
        dwell(300'000'000);
        const std::size_t back = events.size();
        for (const int axis : {0, 1, 2})
            walk(static_cast<std::size_t>(axis), -away[static_cast<std::size_t>(axis)]);
        dwell(100'000'000);
        return back;
    }

    std::vector<Event> events;

    [[nodiscard]] InspectionStart start() const {
        return InspectionStart::at_power_on(machine_, start_, start_pressed_);
    }
    [[nodiscard]] const Position& at_mm() const { return at_mm_; }
    [[nodiscard]] Instant now() const { return instant_from_ns(time_ns_); }

  private:
    [[nodiscard]] double steps_per_mm(std::size_t axis) const { return machine_.axes[axis].steps_per_mm; }
    [[nodiscard]] std::int64_t trigger(std::size_t axis) const {
        return std::llround(machine_.axes[axis].trigger_mm * steps_per_mm(axis));
    }
    void approach(std::size_t axis, std::int64_t interval_ns) {
        while (!pressed_[axis]) tick(axis, -1, interval_ns);
    }
    void walk(std::size_t axis, int steps) {
        for (int i = std::abs(steps); i > 0; --i) tick(axis, steps > 0 ? 1 : -1, 20'000);
    }
    void tick(std::size_t axis, int direction, std::int64_t interval_ns) {
        time_ns_ += interval_ns;
        emit(axis, direction);
    }
    void step_to(std::size_t axis, std::int64_t wanted) {
        while (steps_[axis] != wanted) {
            const int direction = wanted > steps_[axis] ? 1 : -1;
            steps_[axis] += direction;
            emit(axis, direction);
        }
    }
    void emit(std::size_t axis, int direction) {
        absolute_[axis] += direction;
        events.push_back({Event::Kind::step, time_ns_, static_cast<int>(axis), direction});
        if (axis >= kSlideCount) return;
        const bool pressed = absolute_[axis] <= trigger(axis);
        if (pressed == pressed_[axis]) return;
        pressed_[axis] = pressed;
        events.push_back(
            {pressed ? Event::Kind::closes : Event::Kind::opens, time_ns_, static_cast<int>(axis), 0});
    }

    Machine machine_;
    std::array<std::int64_t, kAxisCount> start_{};
    std::array<std::int64_t, kAxisCount> absolute_{};
    std::array<bool, kSlideCount> start_pressed_{};
    std::array<bool, kSlideCount> pressed_{};
    std::array<std::int64_t, kAxisCount> steps_{};
    Position at_mm_{};
    std::int64_t time_ns_ = 0;
};

/// Shows `events` to an inspector of `gcode`, and returns what it found.
inline Findings inspect(const Machine& machine, const std::string& gcode, const std::vector<Event>& events,
                        const InspectionStart& start) {
    TextSource source(gcode);
    Inspector inspector(machine, source, start);
    std::array<std::int64_t, kAxisCount> position = start.built;
    std::int64_t last_ns = 0;
    for (const Event& event : events) {
        const Instant at = instant_from_ns(event.time_ns);
        last_ns = event.time_ns;
        if (event.kind != Event::Kind::step) {
            inspector.on_endstop(at, event.axis, event.kind == Event::Kind::closes);
            continue;
        }
        std::int64_t& place = position[static_cast<std::size_t>(event.axis)];
        place += event.direction;
        inspector.on_step(
            {at, static_cast<std::uint8_t>(event.axis), static_cast<std::int8_t>(event.direction), place});
    }
    return inspector.finish(instant_from_ns(last_ns + 100'000'000));
}

}  // namespace qduino::twin::testing
