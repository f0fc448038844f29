// The account of a budget against its rules, one nanosecond at a time: the same events, the same
// effects, the same tokens.

#include <gtest/gtest.h>

#include <random>

#include "sched/budget_account.h"
#include "tests/oracle/sched/naive_budget_account.h"

namespace qduino::sched::oracle::budget_account_oracle_test {
namespace {

/// Random events in an order that may be, each told to both accounts.
class Pair {
  public:
    explicit Pair(std::uint64_t seed) : random_(seed) {
        const std::int64_t budget = pick(1, 8);  // 16 refills hold 8 tokens without a merge
        const VcpuParameters parameters{Nanoseconds{budget}, Nanoseconds{budget + pick(0, 40)}};
        now_ = pick(0, 50);
        const Server server{SporadicServer{parameters, instant_from_ns(now_)}};
        account_ = BudgetAccount{server, reading()};
        naive_ = {server, reading()};
    }

    void step() {
        if (account_.phase() == BudgetAccount::Phase::throttled) return sleep();
        if (account_.waits()) return wake();
        run();
        const std::int64_t what = pick(0, 9);
        if (what < 4) return compare(account_.timer(reading()), naive_.timer(reading()));
        if (what < 7) return wait();
        if (what < 9 && locks_ < 3) return take();
        if (locks_ > 0) release();
    }

  private:
    std::int64_t pick(std::int64_t low, std::int64_t high) {
        return std::uniform_int_distribution<std::int64_t>{low, high}(random_);
    }
    BudgetReading reading() const { return {instant_from_ns(now_), Nanoseconds{cpu_}, switches_}; }
    /// Time passes, some of it the thread's; the clocks may be read apart, or run back by one.
    void run() {
        const std::int64_t used = pick(0, 6);
        cpu_ += used;
        now_ += used + (pick(0, 3) == 0 ? pick(0, 30) : 0) - (pick(0, 15) == 0 ? 1 : 0);
        if (pick(0, 5) == 0) ++switches_;
    }
    void wait() {
        until_ = pick(0, 3) == 0 ? kForever : instant_from_ns(now_ + pick(-1, 60));
        compare(account_.blocks(reading(), until_), naive_.blocks(reading(), until_));
    }
    void wake() {
        now_ = until_ == kForever ? now_ + pick(0, 80) : std::max(now_, to_ns(until_)) + pick(0, 4);
        cpu_ += pick(0, 2);
        if (pick(0, 9) != 0) ++switches_;
        const Instant now = instant_from_ns(now_);
        compare(account_.woke(now, Nanoseconds{cpu_}), naive_.woke(now, Nanoseconds{cpu_}));
    }
    void sleep() {
        now_ = std::max(now_, to_ns(account_.server().next_replenishment())) + pick(0, 2);
        cpu_ += pick(0, 1);
        ++switches_;
        compare(account_.resumed(reading()), naive_.resumed(reading()));
    }
    void take() {
        ++locks_;
        account_.holds();
        naive_.holds();
    }
    void release() {
        --locks_;
        const bool settle = account_.releases();
        ASSERT_EQ(settle, naive_.releases());
        if (settle) compare(account_.timer(reading()), naive_.timer(reading()));
    }
    void compare(const BudgetEffect& effect, const BudgetEffect& expected) {
        ASSERT_EQ(effect.kind, expected.kind);
        ASSERT_EQ(effect.in, expected.in);
        ASSERT_EQ(effect.at, expected.at);
        if (account_.phase() == BudgetAccount::Phase::woken) return;  // the server is not told yet
        ASSERT_EQ(account_.server().consumed().count(), naive_.consumed());
        ASSERT_EQ(tokens_of(account_.server().refills()), naive_.tokens().tokens());
    }

    std::mt19937_64 random_;
    BudgetAccount account_;
    NaiveBudgetAccount<BudgetRules{}> naive_;
    std::int64_t now_ = 0, cpu_ = 0, switches_ = 0;
    Instant until_{};
    int locks_ = 0;
};

TEST(BudgetAccountOracle, TheEffectsAreThoseOfTheRules) {
    for (std::uint64_t seed = 1; seed <= 2000; ++seed) {
        Pair pair{seed};
        for (int i = 0; i < 300; ++i) {
            pair.step();
            if (::testing::Test::HasFatalFailure()) FAIL() << "seed " << seed << ", step " << i;
        }
    }
}

}  // namespace
}  // namespace qduino::sched::oracle::budget_account_oracle_test
