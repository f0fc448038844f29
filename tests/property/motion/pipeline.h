// Runs moves through planner and solver as loop 1 does, and keeps everything that came out.
#pragma once

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
    /// To a standstill, and everything out.
    void finish() {
        planner->flush();
        pump();
        solver.drain();
        solve();
    }
    void solve() {
        solver.solve_some(~std::size_t{0}, [&](const printer::step::StepEvent& event) {
            if (keep_events) events.push_back(event);
        });
    }

    std::unique_ptr<printer::motion::Planner> planner;
    printer::step::Solver solver;
    bool keep_segments = true;
    bool keep_events = true;
    std::vector<printer::motion::Segment> segments;
    std::vector<printer::step::StepEvent> events;
};

}  // namespace qduino::test
