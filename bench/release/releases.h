// The latency of a periodic release: from the instant at which a loop is due to the first
// instruction of its body.
//
//   due               due + T
//    │··██·············│··██·············    our loop: waitForNextPeriod() on the Linux board, its
//    └┬┘    │··██·············│··██······    budget enforced; below it cyclictest (rt-tests):
//   latency                                  clock_nanosleep, the same priority, period and core
//
// What the host and the load do in one second differs from the next, and the causes of one late
// release in a thousand come in bursts. So both run at once, half a period apart. Either runs for
// some 10 us a period; they meet only when something stops both.
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
/// The board gives this priority to the only loop of a sketch; cyclictest gets the same.
inline constexpr int kReleasePriority = 80;

struct Contenders {
    Releases qduino;
    Releases cyclictest;  ///< failure when it (Debian's rt-tests) is not installed
};

/// Runs both for `length`; ours alone where cyclictest cannot run. The phase of either within the
/// scheduling tick differs from run to run.
Contenders run_both(Nanoseconds length);

}  // namespace qduino::bench
