// The worst schedule of a set of loops, as admission thinks of it: all are released together, each
// wants its whole budget in every period, and all that the platform takes comes as early as it may
// (Liu, Layland, JACM 1973: the critical instant). The scheduler is the one that also runs the
// simulator.
//
// An I/O VCPU has work all the time, for the loop of the shortest period or the client that it
// names. That is not the worst that admission counts for it. Waits for locks, sleeps, and the two
// budgets that a deferrable server may give in close succession (sched/deferrable_server.h) are not
// drawn at all. So a loop's first end is at most its R, and just its R on a core without any of
// these.
#pragma once

#include <span>

#include "report/picture/recorder.h"
#include "sched/load.h"

namespace qduino::apps::picture {

/// Adds one core's schedule to `recorder`, from kEpoch to `until`. VCPUs that a scheduler would not
/// take (0 < budget <= period) are left out. `owner`: the loop that has this core for itself; 0:
/// none.
void record_critical_instant(std::span<const sched::Vcpu> vcpus, const sched::PlatformOverheads& overheads,
                             VcpuId owner, Instant until, Recorder& recorder);

}  // namespace qduino::apps::picture
