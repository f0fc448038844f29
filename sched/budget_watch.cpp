#include "sched/budget_watch.h"

#include <algorithm>

#include "sched/exact.h"

namespace qduino::sched {

namespace {

constexpr Nanoseconds kSecondOverrun = 5ms;
constexpr int kWaitDivisor = 80;
/// A longer time fills any account.
constexpr Nanoseconds kLongest = 3 * kPeriodMax;

Nanoseconds wait_of(Nanoseconds asked, VcpuParameters vcpu) {
    return std::min(asked, std::max(vcpu.period / kWaitDivisor, BudgetWatch::kWaitInAnyPeriod));
}

}  // namespace

BudgetWatch::BudgetWatch(VcpuParameters vcpu, Nanoseconds wait, Instant now, ThreadTimes times)
    : vcpu_(vcpu),
      wait_asked_(wait),
      wait_(wait_of(wait, vcpu)),
      started_at_(now),
      looked_at_(now),
      next_look_(now),
      cpu_at_start_(times.cpu),
      times_(times),
      level_(vcpu.budget) {}

Nanoseconds BudgetWatch::earned_in(Nanoseconds time) const {
    const std::int64_t ns = to_ns(std::min(time, kLongest));
    const std::int64_t own = mul_div_floor(ns, to_ns(vcpu_.budget + wait_), to_ns(vcpu_.period));
    return Nanoseconds{own + ns / kMarginDivisor};
}

/// Rounded up: the margin is left out.
Nanoseconds BudgetWatch::time_to_earn(Nanoseconds amount) const {
    return Nanoseconds{mul_div_ceil(to_ns(amount), to_ns(vcpu_.period), to_ns(vcpu_.budget + wait_))};
}

Nanoseconds BudgetWatch::patience() const {
    return vcpu_.budget + std::min(vcpu_.budget, kSecondOverrun) + kTick + backlog_;
}

void BudgetWatch::settle(Instant now, ThreadTimes times) {
    now = std::max(now, looked_at_);
    times.cpu = std::max(times.cpu, times_.cpu);
    times.delayed = std::max(times.delayed, times_.delayed);
    const Nanoseconds used = times.cpu - times_.cpu;
    const Nanoseconds delayed = times.delayed - times_.delayed;
    const Nanoseconds full = std::max(2 * vcpu_.budget, 2 * kTick);
    // What it used may have come first: full is what is more than full afterwards.
    level_ += earned_in(now - looked_at_) - used;
    if (level_ >= full) {
        cut_ += level_ - full;
        level_ = full;
        backlog_ = Nanoseconds{0};
        escaped_ = false;
    }
    if (used > Nanoseconds{0} || delayed > Nanoseconds{0}) {
        backlog_ += std::min(cut_, earned_in(delayed));
        cut_ = Nanoseconds{0};
    }
    looked_at_ = now;
    times_ = times;
}

void BudgetWatch::change(Instant now, ThreadTimes times, VcpuParameters vcpu) {
    settle(now, times);
    vcpu_ = vcpu;
    wait_ = wait_of(wait_asked_, vcpu);
    level_ = std::max(level_, -patience());
    next_look_ = looked_at_;
}

BudgetWatch::Verdict BudgetWatch::look(Instant now, ThreadTimes times) {
    settle(now, times);
    const Nanoseconds enough = std::max(vcpu_.budget, kTick);
    const Nanoseconds least = escaped_ ? Nanoseconds{0} : -patience();
    if (held_ ? level_ < enough : level_ < least && goes_on()) {
        if (!held_) ++holds_;
        held_ = escaped_ = true;
        fallen_ = false;
        next_look_ = looked_at_ + std::max(time_to_earn(enough - level_), kTick);
        return Verdict::hold;
    }
    held_ = false;
    if (level_ >= least) fallen_ = false;
    // It cannot use more than the time that passes.
    next_look_ = looked_at_ + std::max(level_ - least, kTick);
    return Verdict::run;
}

/// True when a thread whose level is below what the patience allows goes on to use CPU time.
bool BudgetWatch::goes_on() {
    if (!fallen_) {
        fallen_ = true;
        fell_to_ = level_;
    }
    return escaped_ || level_ < fell_to_ - kGrace;
}

}  // namespace qduino::sched
