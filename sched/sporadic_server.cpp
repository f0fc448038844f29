#include "sched/sporadic_server.h"

#include <algorithm>

#include "base/contract.h"

namespace qduino::sched {

SporadicServer::SporadicServer(VcpuParameters parameters, Instant start, SporadicServerOptions options)
    : parameters_(parameters),
      refills_(start, parameters.budget, options.refill_limit),
      shortest_run_(options.shortest_run) {
    QDUINO_EXPECT(parameters.valid());
}

Nanoseconds SporadicServer::available(Instant now) const { return refills_.contiguous_from(now); }

Nanoseconds SporadicServer::consume(Instant now_end, Nanoseconds used) {
    QDUINO_EXPECT(used >= Nanoseconds{0});
    const Nanoseconds overrun = std::max(used - refills_.contiguous_from(now_end - used), Nanoseconds{0});
    refills_.spend(used, parameters_.period);
    refills_.join_splinters(shortest_run_);
    // A gap comes back one period after it was left, for as long as nobody waits: for ever.
    if (!eligible(now_end)) refills_.close_gaps(shortest_run_);
    consumed_ += used;
    QDUINO_EXPECT(total() == parameters_.budget);
    return overrun;
}

void SporadicServer::unblock(Instant now) {
    if (!blocked_) return;
    blocked_ = false;
    refills_.advance(now);
    refills_.join_splinters(shortest_run_);
    QDUINO_EXPECT(total() == parameters_.budget);
}

void SporadicServer::block(Instant) { blocked_ = true; }

}  // namespace qduino::sched
