#include "sched/pibs.h"

#include <algorithm>

#include "base/contract.h"
#include "sched/exact.h"

namespace qduino::sched {

Pibs::Pibs(VcpuParameters parameters, Instant start, Nanoseconds activation, Nanoseconds client_period)
    : parameters_(parameters),
      activation_(activation),
      usual_client_(client_period > Nanoseconds{0} ? client_period : parameters.period),
      eligible_from_(start),
      charged_from_(start) {
    QDUINO_EXPECT(parameters.valid() && activation >= Nanoseconds{0});
}

Nanoseconds Pibs::budget_for(Nanoseconds client_period) const {
    const std::int64_t share =
        mul_div_floor(parameters_.budget.count(), client_period.count(), parameters_.period.count());
    return Nanoseconds{std::max<std::int64_t>(share, 1)};
}

Nanoseconds Pibs::recovery_of(Nanoseconds used) const {
    return Nanoseconds{mul_div_ceil(used.count(), parameters_.period.count(), parameters_.budget.count())};
}

Nanoseconds Pibs::client_period() const {
    QDUINO_EXPECT(active_);
    return client_period_;
}

Nanoseconds Pibs::available(Instant now) const {
    return active_ && eligible_from_ <= now ? remaining_ : Nanoseconds{0};
}

void Pibs::activate(Instant now, Nanoseconds client_period) {
    QDUINO_EXPECT(client_period > Nanoseconds{0} && client_period <= kPeriodMax);
    if (!active_) {
        active_ = true;
        client_period_ = client_period;
        open_service(now);
    } else if (client_period < client_period_) {
        raise(now, client_period);
    }
}

void Pibs::raise(Instant now, Nanoseconds client_period) {
    client_period_ = client_period;
    remaining_ = std::min(remaining_, budget_for(client_period));
    if (eligible_from_ > now) return;
    // What it uses from here on counts at the new priority, so it is charged from here on. Charged
    // from an older instant, it would come back too soon for the VCPUs that it now delays.
    charged_from_ = std::max(now, charged_from_ + recovery_of(used_));
    used_ = Nanoseconds{0};
}

void Pibs::open_service(Instant now) {
    eligible_from_ = std::max(eligible_from_, now);
    charged_from_ = eligible_from_;
    remaining_ = std::max(budget_for(client_period_) - activation_, Nanoseconds{1});
    used_ = activation_;
}

void Pibs::close_service() {
    last_used_ = used_;
    eligible_from_ = charged_from_ + recovery_of(used_);
    charged_from_ = eligible_from_;
    remaining_ = used_ = Nanoseconds{0};
}

/// Runs without budget: that is the service's before, and the next one is later by it.
void Pibs::run_without_budget(Nanoseconds used) {
    const Nanoseconds before = recovery_of(last_used_);
    last_used_ += used;
    eligible_from_ = charged_from_ += recovery_of(last_used_) - before;
}

void Pibs::block(Instant now) {
    if (!active_) return;
    active_ = false;
    if (eligible_from_ <= now) return close_service();
    remaining_ = used_ = Nanoseconds{0};  // it has not begun: there is no activation to pay for
}

void Pibs::change(Instant now, VcpuParameters parameters) {
    QDUINO_EXPECT(parameters.valid());
    const bool begun = active_ && eligible_from_ < now;
    if (begun) close_service();
    parameters_ = parameters;
    if (active_) open_service(now);
}

/// A late timer may let one piece reach beyond the service in hand: what follows is the next one's
/// if that may begin by then, and else without budget.
Nanoseconds Pibs::consume(Instant now_end, Nanoseconds used) {
    QDUINO_EXPECT(used >= Nanoseconds{0});
    consumed_ += used;
    if (!active_) {
        used_ += used;
        close_service();
        return used;
    }
    while (used > Nanoseconds{0}) {
        // It never catches up with a replenishment that it ran before: each ns delays that by 1/U.
        if (eligible_from_ > now_end - used) {
            run_without_budget(used);
            return used;
        }
        const Nanoseconds part = std::min(used, remaining_);
        used -= part;
        used_ += part;
        remaining_ -= part;
        if (remaining_ > Nanoseconds{0}) continue;
        close_service();
        open_service(now_end - used);
    }
    QDUINO_EXPECT(remaining_ > Nanoseconds{0} && remaining_ <= budget_for(client_period_));
    return Nanoseconds{0};
}

}  // namespace qduino::sched
