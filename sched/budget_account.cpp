#include "sched/budget_account.h"

#include <algorithm>

#include "base/contract.h"
#include "sched/budget_watch.h"

namespace qduino::sched {

using Kind = BudgetEffect::Kind;

BudgetAccount::BudgetAccount(const Server& server, const BudgetReading& reading, Nanoseconds rest)
    : server_(server),
      rest_(rest),
      settled_at_(reading.now),
      charged_to_(reading.cpu),
      switches_(reading.switches) {
    server_.wake(reading.now);
}

// ---- events -------------------------------------------------------------------------------------

BudgetEffect BudgetAccount::timer(const BudgetReading& reading) {
    QDUINO_EXPECT(!waits() && phase_ != Phase::throttled);
    settle(reading);
    return go_on();
}

BudgetEffect BudgetAccount::blocks(const BudgetReading& reading, Instant until) {
    QDUINO_EXPECT(!waits() && phase_ != Phase::throttled);
    settle(reading);
    server_.block(settled_at_);
    // The wait to come. When there is none after all, settle() sees a wait that was none: no harm.
    ++switches_;
    due_ = until;
    phase_ = Phase::waiting;
    if (until == kForever || until <= settled_at_) return {.kind = Kind::disarm};
    Server then = server_;
    then.wake(until);
    const Nanoseconds budget = then.available(until);
    if (budget <= Nanoseconds{0}) return {.kind = Kind::disarm};
    phase_ = Phase::armed_ahead;
    return {.kind = Kind::arm_at, .at = until + budget};
}

BudgetEffect BudgetAccount::woke(Instant now, Nanoseconds cpu) {
    QDUINO_EXPECT(waits());
    // There will have been budget at the instant that was waited for, and there is no less of it
    // later.
    const bool armed = phase_ == Phase::armed_ahead;
    phase_ = Phase::woken;
    woke_at_ = std::max(settled_at_, now);
    cpu_at_wake_ = cpu;
    return armed ? BudgetEffect{} : go_on();
}

BudgetEffect BudgetAccount::resumed(const BudgetReading& reading) {
    QDUINO_EXPECT(phase_ == Phase::throttled);
    // That sleep is the account's own, and no wait of the thread's.
    switches_ = reading.switches;
    if (admission_has_a_way(reading.now))
        charged_to_ += std::clamp(reading.cpu - charged_to_, Nanoseconds{0}, longest_way_left_out());
    settle(reading);
    return go_on();
}

BudgetEffect BudgetAccount::change(const BudgetReading& reading, VcpuParameters parameters) {
    QDUINO_EXPECT(!waits() && phase_ != Phase::throttled);
    settle(reading);
    server_.change(settled_at_, parameters);
    return go_on();
}

void BudgetAccount::release(Instant nominal) {
    take_up_work();
    server_.release(nominal);
}

void BudgetAccount::holds() {
    take_up_work();  // what it has overrun so far is not the lock's
    if (locks_++ == 0) grace_ = std::max(server_.parameters().budget, overrun_);
}

bool BudgetAccount::releases() {
    QDUINO_EXPECT(locks_ > 0);
    return --locks_ == 0 && phase_ == Phase::overrunning;
}

// ---- the account --------------------------------------------------------------------------------

/// What the thread does next, by what the server has at the last instant that is known.
BudgetEffect BudgetAccount::go_on() {
    take_up_work();
    const Nanoseconds left = server_.available(settled_at_);
    if (left > Nanoseconds{0}) {
        phase_ = Phase::running;
        return {.kind = Kind::arm_in, .in = left};
    }
    if (locks_ > 0 && grace_ > Nanoseconds{0}) {
        phase_ = Phase::overrunning;
        return {.kind = Kind::arm_in, .in = grace_, .steps_back = true};
    }
    phase_ = Phase::throttled;
    return {.kind = Kind::sleep_until, .at = server_.next_replenishment() + rest_};
}

/// Charges what was used since the last event.
void BudgetAccount::settle(const BudgetReading& reading) {
    take_up_work();
    const Instant now = std::max(reading.now, settled_at_);
    // The clocks are read one after the other: never more than the time that passed. The rest is
    // charged next time.
    const Nanoseconds used = std::clamp(reading.cpu - charged_to_, Nanoseconds{0}, now - settled_at_);
    if (reading.switches != switches_) {  // it waited for something, unannounced
        server_.block(settled_at_);
        server_.wake(now - used);
        switches_ = reading.switches;
    }
    charge(now, used);
    charged_to_ += used;
    settled_at_ = now;
}

void BudgetAccount::charge(Instant end, Nanoseconds used) {
    grace_ -= std::min(grace_, server_.consume(end, used));
}

/// Tells the server of a wake-up that it has not been told of yet. What the way through the wait
/// took and admission has not counted is charged as if it had run just before the wake-up: late,
/// never early, and what is left is left at once.
void BudgetAccount::take_up_work() {
    if (phase_ != Phase::woken) return;
    phase_ = Phase::running;
    const Nanoseconds way = admission_has_a_way(woke_at_) ? Nanoseconds{0} : cpu_at_wake_ - charged_to_;
    server_.wake(std::max(settled_at_, std::min(due_, woke_at_ - way)));
    charge(woke_at_, way);
    settled_at_ = woke_at_;
    charged_to_ = cpu_at_wake_;
}

/// The longest part of the way through a sleep for a spent budget that is left out: half of what
/// the warden overlooks in a period.
Nanoseconds BudgetAccount::longest_way_left_out() const {
    return std::max(server_.parameters().period / (2 * BudgetWatch::kMarginDivisor),
                    BudgetWatch::kWaitInAnyPeriod);
}

/// True once in each period, and twice after a period without. What makes that one way longer than
/// admission has it is not the loop's doing: an interrupt, or the host.
bool BudgetAccount::admission_has_a_way(Instant woke_at) {
    const Nanoseconds period = server_.parameters().period;
    if (next_admitted_way_ - period > woke_at) return false;
    next_admitted_way_ = std::max(next_admitted_way_, woke_at) + period;
    return true;
}

}  // namespace qduino::sched
