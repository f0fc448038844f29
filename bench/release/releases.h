// The latency of a periodic release: from the instant at which a loop is due to the first instruction of its body.
//
//   due        due + T
//    │··██·····│··██·····      our loop: waitForNextPeriod() on the Linux board, its budget enforced
//    └┬┘                       cyclictest (rt-tests): clock_nanosleep, the same priority, period and core
//   latency
#pragma once

#include <string>
#include <vector>

#include "base/time.h"
#include "bench/rig/report.h"

namespace qduino::bench {

struct Releases {
    std::vector<std::int64_t> latencies_ns;
    Nanoseconds phase{};  ///< of the instants that were due, within their period; not known of cyclictest
    Json guarantee;       ///< null for cyclictest
    std::string failure;
};

inline constexpr Nanoseconds kReleasePeriod = 1ms;
inline constexpr Nanoseconds kReleaseBudget = 250us;
/// What the board gives to the only loop of a sketch; cyclictest is told the same.
inline constexpr int kReleasePriority = 80;

Releases run_qduino(Nanoseconds length);
/// At the same phase, for a release that falls on the scheduling tick (every 4 ms, four periods) is late and the others are not.
/// Failure when cyclictest (Debian's rt-tests) is not installed.
Releases run_cyclictest(Nanoseconds length, Nanoseconds phase);

}  // namespace qduino::bench
