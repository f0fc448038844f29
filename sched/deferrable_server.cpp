#include "sched/deferrable_server.h"

#include <algorithm>
#include <utility>

#include "base/contract.h"
#include "sched/exact.h"

namespace qduino::sched {

DeferrableServer::DeferrableServer(VcpuParameters parameters, Instant start, Nanoseconds shortest_run)
    : parameters_(parameters),
      period_{start, parameters.budget, start},
      shortest_run_(std::clamp(shortest_run, Nanoseconds{1}, parameters.budget)) {
    QDUINO_EXPECT(parameters.valid());
}

DeferrableServer::Period DeferrableServer::period_at(Instant now) const {
    const std::int64_t passed = std::max<std::int64_t>((now - period_.begin) / parameters_.period, 0);
    // As many budgets as fill it up; a debt takes more than one.
    const std::int64_t counted =
        std::min(passed, div_ceil((parameters_.budget - period_.left).count(), parameters_.budget.count()));
    if (passed == 0) return period_;
    const Instant begin = period_.begin + passed * parameters_.period;
    return {begin, std::min(period_.left + counted * parameters_.budget, parameters_.budget), begin};
}

Nanoseconds DeferrableServer::available(Instant now) const {
    const Period period = period_at(now);
    const Nanoseconds rest = period.begin + parameters_.period - now;
    // What is left lasts to the period's end: the next budget follows it.
    if (period.left >= rest) return rest + parameters_.budget;
    return std::max(period.left, Nanoseconds{0});
}

Instant DeferrableServer::next_replenishment() const {
    if (period_.left > Nanoseconds{0}) return period_.begin;
    const Nanoseconds lacking = shortest_run_ - period_.left;
    return period_.begin + div_ceil(lacking.count(), parameters_.budget.count()) * parameters_.period;
}

Nanoseconds DeferrableServer::consume(Instant now_end, Nanoseconds used) {
    QDUINO_EXPECT(used >= Nanoseconds{0});
    consumed_ += used;
    Nanoseconds overrun{0};
    while (used > Nanoseconds{0}) {
        const Instant begin = now_end - used;
        period_ = period_at(begin);
        const Nanoseconds part = std::min(used, period_.begin + parameters_.period - begin);
        overrun += std::max(part - std::max(period_.left, Nanoseconds{0}), Nanoseconds{0});
        period_.left -= part;
        used -= part;
    }
    return overrun;
}

void DeferrableServer::unblock(Instant now) {
    if (!blocked_) return;
    blocked_ = false;
    const Period period = period_at(now);
    // Whole periods went by, or there was none yet: this one begins with the work.
    if (!std::exchange(had_work_, true))
        period_.begin = now;
    else if (period.begin != period_.begin)
        period_ = {now, period.left, period_.begin + parameters_.period};
}

void DeferrableServer::release(Instant nominal) {
    if (nominal >= period_.begin + parameters_.period)
        period_ = {nominal, period_at(nominal).left, nominal};
    else if (nominal >= period_.earliest)
        period_.begin = nominal;
}

void DeferrableServer::block(Instant now) {
    period_ = period_at(now);
    blocked_ = true;
}

}  // namespace qduino::sched
