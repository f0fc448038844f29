// The latency of a periodic release: from the instant at which a loop is due to the first instruction of its body.
//
//   due               due + T
//    │··██·············│··██·············      our loop: waitForNextPeriod() on the Linux board, its budget enforced
//    └┬┘    │··██·············│··██······      cyclictest (rt-tests): clock_nanosleep, the same priority, period and core
//   latency
//
// Both at once, half a period apart: what the host and the load do within a second is not what they do in the next, and what makes one
// release in a thousand late comes in bursts. Either runs for some 10 us a period; they meet only when something stops both.
#pragma once

#include <string>
#include <vector>

#include "base/time.h"
#include "bench/rig/report.h"

namespace qduino::bench {

struct Releases {
    std::vector<std::int64_t> latencies_ns;
    Json guarantee;  ///< null for cyclictest
    std::string failure;
};

inline constexpr Nanoseconds kReleasePeriod = 1ms;
inline constexpr Nanoseconds kReleaseBudget = 250us;
/// What the board gives to the only loop of a sketch; cyclictest is told the same.
inline constexpr int kReleasePriority = 80;

struct Contenders {
    Releases qduino;
    Releases cyclictest;  ///< failure when it (Debian's rt-tests) is not installed
};

/// Both for `length`, ours alone where cyclictest cannot run. At which phase of the scheduling tick either stands differs from run to run.
Contenders run_both(Nanoseconds length);

}  // namespace qduino::bench
