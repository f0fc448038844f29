// The account of a budget by its rules, one nanosecond of CPU time at a time: a list of tokens, and
// for each nanosecond that the thread has used how often it was charged. Each rule can be broken,
// so that tests can show that they would notice.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "sched/budget_account.h"
#include "tests/oracle/sched/token_server.h"

namespace qduino::sched::oracle {

struct BudgetRules {
    int charges = 1;                   // of each nanosecond
    bool charge_further_waits = true;  // the way through a wait that admission has not counted
    bool wait_of_each_period = true;   // admission has counted one of them
    bool wake_the_server = true;       // an idle server saves nothing up
    bool find_silent_waits = true;     // by the count of switches
    bool finish_with_lock = true;      // who holds a lock is not throttled
    bool throttle_at_unlock = true;    // when he has overrun
    std::int64_t sleep_longer_by = 0;  // periods
};

/// A bucket that loses one nanosecond in each, and is full with two periods: each admitted wait
/// puts one period in.
class WaitBucket {
  public:
    explicit WaitBucket(std::int64_t period) : period_(period) {}
    bool admits(std::int64_t now) {
        for (; seen_ < now && level_ > 0; ++seen_) --level_;
        seen_ = std::max(seen_, now);
        if (level_ > period_) return false;
        level_ += period_;
        return true;
    }

  private:
    std::int64_t period_;
    std::int64_t level_ = 0;
    std::int64_t seen_ = 0;
};

template <BudgetRules kRules>
class NaiveBudgetAccount {
  public:
    using Kind = BudgetEffect::Kind;

    NaiveBudgetAccount() : NaiveBudgetAccount(1, 1) {}
    NaiveBudgetAccount(const Server& server, const BudgetReading& reading, Nanoseconds rest = {})
        : NaiveBudgetAccount(server.parameters().budget.count(), server.parameters().period.count()) {
        rest_ = rest;
        now_ = to_ns(reading.now);
        switches_ = reading.switches;
        charges_.assign(static_cast<std::size_t>(reading.cpu.count()), 0);
        tokens_.wake(now_);
    }

    BudgetEffect timer(const BudgetReading& reading) {
        settle(reading);
        return go_on();
    }
    BudgetEffect blocks(const BudgetReading& reading, Instant until) {
        settle(reading);
        ++switches_;
        overruns_ = armed_ = false;
        due_ = to_ns(until);
        if (until == kForever || to_ns(until) <= now_) return {.kind = Kind::disarm};
        TokenServer then = tokens_;
        then.wake(to_ns(until));
        const std::int64_t budget = then.contiguous_from(to_ns(until));
        armed_ = budget > 0;
        if (!armed_) return {.kind = Kind::disarm};
        return {.kind = Kind::arm_at, .at = until + Nanoseconds{budget}};
    }
    BudgetEffect woke(Instant now, Nanoseconds cpu) {
        const std::int64_t woke = std::max(now_, to_ns(now));
        const bool admitted = bucket_.admits(woke) && kRules.wait_of_each_period;
        const int charges = admitted || !kRules.charge_further_waits ? 0 : kRules.charges;
        const std::int64_t way = cpu.count() - static_cast<std::int64_t>(charges_.size());
        if (kRules.wake_the_server)
            tokens_.wake(std::max(now_, std::min(due_, woke - (charges > 0 ? way : 0))));
        charge_to(cpu.count(), woke, charges);
        now_ = woke;
        return armed_ ? BudgetEffect{} : go_on();
    }
    BudgetEffect resumed(const BudgetReading& reading) {
        switches_ = reading.switches;
        if (bucket_.admits(to_ns(reading.now)) && kRules.wait_of_each_period) {
            charge_to(std::max<std::int64_t>(reading.cpu.count(), static_cast<std::int64_t>(charges_.size())),
                      to_ns(reading.now), 0);
            now_ = std::max(now_, to_ns(reading.now));
        }
        settle(reading);
        return go_on();
    }
    void holds() {
        if (locks_++ == 0) grace_ = budget_;
    }
    bool releases() { return --locks_ == 0 && overruns_ && kRules.throttle_at_unlock; }

    [[nodiscard]] const TokenServer& tokens() const { return tokens_; }
    [[nodiscard]] const std::vector<int>& charges() const { return charges_; }
    [[nodiscard]] std::int64_t consumed() const {
        std::int64_t sum = 0;
        for (const int charge : charges_) sum += charge;
        return sum;
    }

  private:
    NaiveBudgetAccount(std::int64_t budget, std::int64_t period)
        : budget_(budget), period_(period), tokens_(budget, period, 0), bucket_(period) {}

    /// Up to `cpu` on the thread's clock, as if it had run without a pause until `end`.
    void charge_to(std::int64_t cpu, std::int64_t end, int times) {
        std::int64_t left = tokens_.contiguous_from(end - (cpu - static_cast<std::int64_t>(charges_.size())));
        while (static_cast<std::int64_t>(charges_.size()) < cpu) {
            charges_.push_back(times);
            for (int i = 0; i < times; ++i) tokens_.spend_one();
            if (times > 0 && --left < 0 && locks_ > 0 && grace_ > 0) --grace_;
        }
    }
    void settle(const BudgetReading& reading) {
        const std::int64_t known = static_cast<std::int64_t>(charges_.size());
        const std::int64_t now = std::max(now_, to_ns(reading.now));
        const std::int64_t used =
            std::min(std::max<std::int64_t>(reading.cpu.count() - known, 0), now - now_);
        if (reading.switches != switches_ && kRules.find_silent_waits) tokens_.wake(now - used);
        switches_ = reading.switches;
        charge_to(known + used, now, kRules.charges);
        now_ = now;
    }
    BudgetEffect go_on() {
        overruns_ = false;
        if (const std::int64_t left = tokens_.contiguous_from(now_); left > 0) {
            return {.kind = Kind::arm_in, .in = Nanoseconds{left}};
        }
        overruns_ = locks_ > 0 && grace_ > 0 && kRules.finish_with_lock;
        if (overruns_) return {.kind = Kind::arm_in, .in = Nanoseconds{grace_}, .steps_back = true};
        const std::int64_t next = tokens_.tokens().front() + kRules.sleep_longer_by * period_;
        return {.kind = Kind::sleep_until, .at = instant_from_ns(next) + rest_};
    }

    Nanoseconds rest_{};
    std::int64_t budget_, period_;
    TokenServer tokens_;
    WaitBucket bucket_;
    std::vector<int> charges_;  // one for each nanosecond of CPU time that is settled
    std::int64_t due_ = 0;      // the end of the wait
    std::int64_t now_ = 0;
    std::int64_t switches_ = 0;
    std::int64_t grace_ = 0;
    int locks_ = 0;
    bool armed_ = false;
    bool overruns_ = false;
};

}  // namespace qduino::sched::oracle
