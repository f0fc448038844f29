// The refill list against the list of unit tokens that it stands for.

#include <gtest/gtest.h>

#include <random>

#include "sched/sporadic_server.h"
#include "tests/oracle/sched/token_server.h"

namespace qduino::sched::oracle::sporadic_server_oracle_test {
namespace {

/// One random step, done to both.
struct Step {
    enum class Kind { wait, run, overrun, sleep_and_wake } kind;
    std::int64_t length;
};

Step random_step(std::mt19937_64& random, std::int64_t budget, std::int64_t period) {
    std::uniform_int_distribution<int> kind{0, 9};
    const int k = kind(random);
    std::uniform_int_distribution<std::int64_t> length{1, k < 7 ? budget : 2 * period};
    if (k < 5) return {Step::Kind::run, length(random)};
    if (k == 5) return {Step::Kind::overrun, length(random)};
    if (k < 8) return {Step::Kind::wait, length(random)};
    return {Step::Kind::sleep_and_wake, length(random)};
}

/// Runs, wakes, overruns at random, and calls `compare(server, oracle, what was)` after each.
template <typename Compare>
void drive(std::uint64_t seed, std::int64_t budget, std::int64_t period, std::size_t limit, Compare compare) {
    std::mt19937_64 random{seed};
    SporadicServer server{{Nanoseconds{budget}, Nanoseconds{period}}, kEpoch, {.refill_limit = limit}};
    TokenServer oracle{budget, period, 0};
    server.unblock(kEpoch);
    std::int64_t now = 0;
    for (int i = 0; i < 400; ++i) {
        const Step step = random_step(random, budget, period);
        std::int64_t run = step.kind == Step::Kind::overrun ? step.length : 0;
        switch (step.kind) {
            case Step::Kind::wait:
                now += step.length;
                break;
            case Step::Kind::run:
                run = std::min(step.length, server.available(instant_from_ns(now)).count());
                break;
            case Step::Kind::overrun:
                break;
            case Step::Kind::sleep_and_wake:
                server.block(instant_from_ns(now));
                now += step.length;
                server.unblock(instant_from_ns(now));
                oracle.wake(now);
                break;
        }
        now += run;
        server.consume(instant_from_ns(now), Nanoseconds{run});
        for (; run > 0; --run) oracle.spend_one();
        compare(server, oracle, now);
        if (::testing::Test::HasFatalFailure()) return;
    }
}

TEST(SporadicServerOracle, TheRefillsAreTheTokens) {
    for (std::uint64_t seed = 1; seed <= 1000; ++seed) {
        const std::int64_t budget = 1 + static_cast<std::int64_t>(seed % RefillQueue::kCapacity);
        const std::int64_t period = budget + static_cast<std::int64_t>(seed * 7 % 90);
        drive(seed, budget, period, RefillQueue::kCapacity,
              [&](const SporadicServer& server, const TokenServer& oracle, std::int64_t now) {
                  ASSERT_EQ(tokens_of(server.refills()), oracle.tokens()) << "seed " << seed;
                  ASSERT_EQ(server.eligible(instant_from_ns(now)), oracle.may_run(now)) << "seed " << seed;
                  ASSERT_EQ(server.available(instant_from_ns(now)).count(), oracle.contiguous_from(now));
              });
    }
}

/// With fewer refills than there are pieces, merges must delay tokens: each is as late as the
/// oracle's, or later, when the oracle starts the step from the tokens that the server had.
TEST(SporadicServerOracle, AMergeDelaysAndNeverAdvances) {
    std::int64_t delayed = 0;
    for (std::uint64_t seed = 1; seed <= 400; ++seed) {
        const std::int64_t budget = 20 + static_cast<std::int64_t>(seed % 30);
        const std::int64_t period = budget + 10 + static_cast<std::int64_t>(seed * 13 % 200);
        const std::size_t limit = 1 + seed % 4;
        drive(seed, budget, period, limit,
              [&](const SporadicServer& server, TokenServer& oracle, std::int64_t) {
                  const auto tokens = tokens_of(server.refills());
                  ASSERT_EQ(tokens.size(), oracle.tokens().size());
                  ASSERT_LE(server.refills().size(), limit);
                  for (std::size_t k = 0; k < tokens.size(); ++k) {
                      ASSERT_GE(tokens[k], oracle.tokens()[k]) << "seed " << seed << ", token " << k;
                      delayed += tokens[k] - oracle.tokens()[k];
                  }
                  oracle.set_tokens(tokens);
              });
    }
    EXPECT_GT(delayed, 0) << "the lists never filled: this test did not test";
}

TEST(SporadicServerOracle, HoldingSplintersBackNeverAdvances) {
    std::mt19937_64 random{42};
    for (int round = 0; round < 2000; ++round) {
        RefillQueue queue{kEpoch, 40ns};
        for (int i = 0; i < 6; ++i) {
            queue.spend(Nanoseconds{std::uniform_int_distribution<std::int64_t>{0, 15}(random)}, 100ns);
            queue.advance(instant_from_ns(std::uniform_int_distribution<std::int64_t>{0, 300}(random)));
        }
        const auto before = tokens_of(queue.refills());
        queue.join_splinters(10ns);
        const auto after = tokens_of(queue.refills());
        ASSERT_EQ(before.size(), after.size());
        for (std::size_t k = 0; k < after.size(); ++k) ASSERT_GE(after[k], before[k]);
        ASSERT_GE(queue.head().amount, 10ns);
        queue.close_gaps(10ns);
        const auto closed = tokens_of(queue.refills());
        ASSERT_EQ(after.size(), closed.size());
        for (std::size_t k = 0; k < closed.size(); ++k) ASSERT_GE(closed[k], after[k]);
        if (queue.refills().size() > 1) {
            ASSERT_GE(queue.refills()[1].time - queue.head().end(), 10ns);
        }
    }
}

}  // namespace
}  // namespace qduino::sched::oracle::sporadic_server_oracle_test
