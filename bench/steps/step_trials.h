// Steps at a given rate, played by the printer's own loop 2 on virtual pins of the Linux board.
//
//   ring, filled before ──► StepperLoop ──► LinuxBoard ──► ring of edges ──► this process counts
//   [core 1, owned: the player spins from step to step            ]          [core 0]
//
// The drivers are quick ones, as the TMC2209 is (its data sheet: STEP high and low 100 ns at least,
// DIR set up 20 ns): an A4988 takes no more than 500 000 steps/s of one motor. The axes step in
// turns, at even distances.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/time.h"
#include "bench/rig/report.h"

namespace qduino::bench {

/// The result of one rate.
struct StepTrial {
    double asked_hz = 0;   ///< steps a second, of all axes together
    double played_hz = 0;  ///< lower where late steps moved the time line
    std::int64_t lateness_ns_p50 = 0, lateness_ns_p99 = 0, lateness_ns_p9999 = 0, lateness_ns_max = 0;
    std::int64_t late_steps = 0;  ///< they moved the time line
};

struct StepTrials {
    std::vector<StepTrial> trials;  ///< in the order of the rates
    /// Rising edges that the other end of the pins saw, less those that were played.
    std::int64_t missing_edges = 0;
    Json guarantee;
    std::string failure;  ///< empty: all ran
};

/// One after the other, `length` each, on the last core.
StepTrials run_step_trials(int axes, const std::vector<double>& rates_hz, Nanoseconds length);

}  // namespace qduino::bench
