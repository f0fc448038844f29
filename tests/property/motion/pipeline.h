// Runs moves through planner and solver as loop 1 does, and keeps everything that came out.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "printer/motion/planner.h"
#include "printer/step/solver.h"

namespace qduino::test {

struct Pipeline {
    explicit Pipeline(const printer::MachineConfig& config, const printer::motion::AxisVector& start_mm = {})
        : planner(
              std::make_unique<printer::motion::Planner>(printer::motion::motion_settings(config), start_mm)),
          solver(printer::motion::motion_settings(config), start_mm) {}

    /// Appends, taking out what is final whenever the queue is full.
    void append(const printer::motion::Move& move) {
        while (!planner->append(move)) pump();
    }
    /// Takes out everything that is final.
    void pump() {
        printer::motion::Segment segment;
        while (planner->next(segment)) {
            if (keep_segments) segments.push_back(segment);
            solver.load(segment);
            solve();
        }
    }
    /// Plans to a standstill, and takes everything out.
    void finish() {
        planner->flush();
        pump();
        solver.drain();
        solve();
    }
    void solve() {
        std::size_t given = portion;
        while (given == portion) {
            given = solver.solve_some(portion, [&](const printer::step::StepEvent& event) {
                if (keep_events) events.push_back(event);
            });
            most_given = std::max(most_given, given);
        }
    }

    std::unique_ptr<printer::motion::Planner> planner;
    printer::step::Solver solver;
    std::size_t portion = ~std::size_t{0};  ///< events asked for at a time
    std::size_t most_given = 0;
    bool keep_segments = true;
    bool keep_events = true;
    std::vector<printer::motion::Segment> segments;
    std::vector<printer::step::StepEvent> events;
};

/// The number of the first event that is not the same step, or where the shorter one ends.
inline std::size_t first_difference(const std::vector<printer::step::StepEvent>& a,
                                    const std::vector<printer::step::StepEvent>& b) {
    const auto same = [](const printer::step::StepEvent& one, const printer::step::StepEvent& other) {
        return one.time_ns == other.time_ns && one.axis == other.axis && one.direction == other.direction;
    };
    return static_cast<std::size_t>(std::ranges::mismatch(a, b, same).in1 - a.begin());
}

}  // namespace qduino::test
