// From an edge on an input to the first instruction of what waits for it.
//
//   machine, core 0       ──▔▔▔▔▔▔▔▔──     edges, 0.7 to 1.3 ms apart
//                           │ published: the edge's instant
//   contender, last core    └──────► █     our handler on an I/O VCPU, its budget enforced; or a
//                           latency        plain SCHED_FIFO thread that sleeps on the same futex
//
// Both have the same priority and core, and take turns: woken by one edge, one of two would have to
// wait for the other.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/time.h"
#include "bench/rig/report.h"

namespace qduino::bench {

struct EdgeLatencies {
    std::vector<std::int64_t> ns;
    Json guarantee;  ///< null for the plain thread
    std::string failure;
};

/// A handler of attachInterrupt() whose I/O VCPU has `budget` in each 10 ms.
EdgeLatencies run_handler(Nanoseconds length, Nanoseconds budget);
/// A thread that waits in futex(2), and nothing else.
EdgeLatencies run_plain_thread(Nanoseconds length);

}  // namespace qduino::bench
