// Short ways to write down VCPUs and instants in tests.
#pragma once

#include <gtest/gtest.h>

#include <initializer_list>

#include "sched/admission.h"

namespace qduino::sched {

constexpr Instant at_ns(std::int64_t ns) { return instant_from_ns(ns); }

inline Vcpu loop_of(VcpuId id, Nanoseconds budget, Nanoseconds period, int core = 0) {
    return {id, budget, period, core};
}

inline Vcpu io_of(VcpuId id, Nanoseconds budget, Nanoseconds period, int core = 0) {
    return {id, budget, period, core, VcpuKind::io};
}

/// The fair server of Linux 6.12 and later, as its defaults have it: 50 ms in every 1 s for
/// ordinary tasks, above SCHED_FIFO. The end of one period's share and the beginning of the next
/// one's can meet, hence its jitter.
inline PlatformInterferer kernel_fair_server() { return {"kernel fair server", 50ms, 1s, 950ms}; }

inline CoreLoad load_of(std::initializer_list<Vcpu> requests) {
    CoreLoad load;
    for (const Vcpu& request : requests) EXPECT_TRUE(load.try_add(request));
    return load;
}

}  // namespace qduino::sched
