// One motion, from standstill to standstill, made by planner and solver and judged as it comes: all
// steps of all motors (step_judge.h). Memory does not grow with the motion.
//
//   moves ─► Pipeline ─┬─ segments ─► SampledMotion ─► SampledMotors ─┐
//            (loop 1)  └─ steps ─────────────────────────────────────┴─► StepJudge, per motor
#pragma once

#include <memory>
#include <vector>

#include "tests/oracle/motion/step_judge.h"
#include "tests/property/motion/pipeline.h"

namespace qduino::test {

/// Moves of one motion that a test judges.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr std::size_t kJudgedMoves = 20;  // it takes ten times as long there
#else
inline constexpr std::size_t kJudgedMoves = 70;
#endif

class MotionJudge {
  public:
    /// The places of motors are looked at this often. A place of the filament that is smoothed is
    /// an integral each time.
    struct Grid {
        Real motors_s = 1e-4L;
        Real filament_s = 8e-4L;
    };

    MotionJudge(const printer::MachineConfig& machine, const printer::motion::AxisVector& at_mm, Grid grid)
        : machine_(machine),
          filters_(printer::motion::motion_settings(machine).filters),
          lead_s_(lead_s(filters_)),
          pipeline_(machine, at_mm),
          nozzle_(filters_),
          motors_(nozzle_, machine_, lead_s_),
          grid_(grid) {}
    MotionJudge(const MotionJudge&) = delete;
    MotionJudge& operator=(const MotionJudge&) = delete;

    /// Its settings may be changed between moves.
    [[nodiscard]] printer::motion::Planner& planner() { return *pipeline_.planner; }
    void append(const printer::motion::Move& move) {
        pipeline_.append(move);
        if (pipeline_.events.size() > kEventsHeld) take();
    }
    /// To a standstill. What was found is then whole.
    Judged finish() {
        pipeline_.finish();
        take();
        if (nozzle_.empty()) return {};
        Judged all;
        for (StepJudge& judge : judges_) {
            judge.judge(nozzle_.end_s() + 2 * lead_s_ + kMargin_s);
            all.add(judge.judged());
        }
        for (std::size_t motor = 0; motor < printer::kAxisCount; ++motor) {
            if (!all.wrong.empty() || judges_[motor].count() == pipeline_.solver.counts()[motor]) continue;
            all.wrong = text<std::string>("motor ", motor, " ends on the wrong count");
        }
        return all;
    }

  private:
    static constexpr std::size_t kEventsHeld = 20'000;
    /// Longer than steps are held back, and than filters reach beyond the lead.
    static constexpr Real kMargin_s = 0.5L;

    void take() {
        for (const auto& segment : pipeline_.segments)
            if (segment.kind == printer::motion::SegmentKind::move) nozzle_.append(segment);
        pipeline_.segments.clear();
        if (nozzle_.empty()) return;
        if (judges_.empty()) begin();
        for (const auto& event : pipeline_.events)
            if (event.kind == printer::step::EventKind::step) judges_[event.axis].add(event);
        pipeline_.events.clear();
        const Real known_s = nozzle_.end_s() - kMargin_s;
        for (StepJudge& judge : judges_) judge.judge(known_s);
        nozzle_.forget_before(known_s - 3 * lead_s_ - 3 * kMargin_s);
    }
    /// The motors stand where the motion begins.
    void begin() {
        const Real gap_s = static_cast<Real>(to_ns(machine_.reversal_gap)) * 1e-9L;
        for (std::size_t motor = 0; motor < printer::kAxisCount; ++motor) {
            const auto count = static_cast<std::int64_t>(std::floor(motors_.steps(motor, 0) + Real{0.5}));
            judges_.emplace_back(motors_, motor, count, gap_s,
                                 motor == 3 ? grid_.filament_s : grid_.motors_s);
        }
    }

    printer::MachineConfig machine_;
    printer::motion::MotionFilters filters_;
    Real lead_s_;
    Pipeline pipeline_;
    SampledMotion nozzle_;
    SampledMotors motors_;
    Grid grid_;
    std::vector<StepJudge> judges_;  // per motor, once something moves
};

}  // namespace qduino::test
