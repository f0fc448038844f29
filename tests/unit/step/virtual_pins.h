// Pins on a virtual clock that remember every edge and know the rules of a stepper driver.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "base/time.h"
#include "printer/step/player.h"

namespace qduino::test {

struct VirtualPins {
    struct Edge {
        std::int64_t ns = 0;
        int axis = 0;
        bool is_step = true;  // else DIR
        bool high = false;
    };

    struct Write {
        std::vector<int> axes;
        bool high = false;
    };

    // What the player sees.
    [[nodiscard]] Instant now() const { return instant_from_ns(now_ns); }
    void busy_until(Instant t) {
        if (to_ns(t) <= now_ns) return;
        now_ns = to_ns(t);
        const auto late = oversleeps_.begin();
        if (late != oversleeps_.end() && late->first <= now_ns) {
            now_ns += late->second;
            oversleeps_.erase(late);
        }
    }
    void sleep_until(Instant t) {
        sleeps.push_back(to_ns(t));
        busy_until(t);
    }
    void set_steps(const printer::step::MotorList& axes, bool high) {
        now_ns += write_cost_ns;
        writes.push_back({{axes.begin(), axes.end()}, high});
        for (const int axis : axes) set_step(axis, high);
    }
    void set_step(int axis, bool high) {
        State& state = states_[static_cast<std::size_t>(axis)];
        if (high) state.position += state.positive ? 1 : -1;
        if (state.high != high) edges.push_back({now_ns, axis, true, high});
        state.high = high;
    }
    void set_direction(int axis, bool positive) {
        now_ns += write_cost_ns;
        State& state = states_[static_cast<std::size_t>(axis)];
        if (state.positive != positive) edges.push_back({now_ns, axis, false, positive});
        state.positive = positive;
    }
    void cut_heat() { heat_cuts.push_back(now_ns); }
    [[nodiscard]] bool endstop_pressed(int axis) const { return endstop && endstop(axis); }
    void watch_switches(int axis, bool on) {
        const auto bit = 1u << static_cast<unsigned>(axis);
        watched = on ? watched | bit : watched & ~bit;
    }

    // What the test sets and sees.
    std::int64_t now_ns = 0;
    std::int64_t write_cost_ns = 0;
    std::function<bool(int)> endstop;
    unsigned watched = 0;  ///< bit per axis whose switches are watched
    std::vector<Edge> edges;
    std::vector<Write> writes;         ///< of STEP pins
    std::vector<std::int64_t> sleeps;  ///< the instants that were slept to
    std::vector<std::int64_t> heat_cuts;

    /// The first wait that ends at or after `ns` returns `late_ns` too late.
    void oversleep_at(std::int64_t ns, std::int64_t late_ns) { oversleeps_[ns] = late_ns; }
    [[nodiscard]] std::vector<std::int64_t> rises(int axis) const { return step_edges(axis, true); }
    [[nodiscard]] std::vector<std::int64_t> falls(int axis) const { return step_edges(axis, false); }
    [[nodiscard]] bool level(int axis) const { return states_[static_cast<std::size_t>(axis)].high; }
    /// As the motor counts: rising edges, by the direction at that instant.
    [[nodiscard]] std::int64_t position(int axis) const {
        return states_[static_cast<std::size_t>(axis)].position;
    }
    /// The first broken rule (pulse and low time of 1 µs, DIR 200 ns before and after a rise), or
    /// nothing.
    [[nodiscard]] std::string broken_rules() const {
        struct Last {
            std::int64_t rise = -1'000'000, fall = -1'000'000, turn = -1'000'000;
        };
        std::array<Last, 4> last{};
        for (const Edge& edge : edges) {
            Last& axis = last[static_cast<std::size_t>(edge.axis)];
            const std::string where =
                " of axis " + std::to_string(edge.axis) + " at " + std::to_string(edge.ns);
            if (!edge.is_step) {
                if (edge.ns - axis.rise < 200) return "hold" + where;
                axis.turn = edge.ns;
            } else if (edge.high) {
                if (edge.ns - axis.fall < 1'000) return "low time" + where;
                if (edge.ns - axis.turn < 200) return "set-up" + where;
                axis.rise = edge.ns;
            } else {
                if (edge.ns - axis.rise < 1'000) return "pulse width" + where;
                axis.fall = edge.ns;
            }
        }
        return "";
    }

  private:
    struct State {
        bool high = false;
        bool positive = true;
        std::int64_t position = 0;
    };
    [[nodiscard]] std::vector<std::int64_t> step_edges(int axis, bool high) const {
        std::vector<std::int64_t> instants;
        for (const Edge& edge : edges) {
            if (edge.is_step && edge.axis == axis && edge.high == high) instants.push_back(edge.ns);
        }
        return instants;
    }

    std::array<State, 4> states_{};
    std::map<std::int64_t, std::int64_t> oversleeps_;
};

}  // namespace qduino::test
