// A sporadic server's promise to lower priorities, on long random runs; and wrong servers, which
// must be caught.
//
// The server is alone at the top priority: whenever it has work and budget it runs. Its work comes
// and goes at random, and enforcement may come late (an overrun).

#include <gtest/gtest.h>

#include <optional>
#include <random>
#include <string>

#include "sched/sporadic_server.h"
#include "tests/oracle/sched/token_server.h"
#include "tests/property/sched/windows.h"

namespace qduino::sched::sporadic_server_property_test {
namespace {

struct Shape {
    std::int64_t budget;
    std::int64_t period;
    std::size_t refill_limit = RefillQueue::kCapacity;
    std::int64_t overrun_most = 0;
};

// ---- servers: the real one, and wrong ones ------------------------------------------------------

class RealServer {
  public:
    explicit RealServer(const Shape& shape)
        : server_({Nanoseconds{shape.budget}, Nanoseconds{shape.period}}, kEpoch,
                  {.refill_limit = shape.refill_limit}) {}
    void unblock(std::int64_t now) { server_.unblock(instant_from_ns(now)); }
    void block(std::int64_t now) { server_.block(instant_from_ns(now)); }
    void consume(std::int64_t end, std::int64_t used) {
        server_.consume(instant_from_ns(end), Nanoseconds{used});
    }
    std::int64_t available(std::int64_t now) const { return server_.available(instant_from_ns(now)).count(); }
    std::int64_t next() const { return to_ns(server_.next_replenishment()); }
    std::int64_t total() const { return server_.total().count(); }

  private:
    SporadicServer server_;
};

/// The tokens of the oracle, with one rule broken by each mutant below.
class TokenMutant {
  public:
    explicit TokenMutant(const Shape& shape)
        : shape_(shape), tokens_(shape.budget, shape.period, 0), budget_(shape.budget) {}
    virtual ~TokenMutant() = default;
    virtual void unblock(std::int64_t now) { tokens_.wake(now); }
    void block(std::int64_t) {}
    virtual void consume(std::int64_t, std::int64_t used) {
        for (; used > 0; --used) tokens_.spend_one();
    }
    std::int64_t available(std::int64_t now) const { return tokens_.contiguous_from(now); }
    std::int64_t next() const { return tokens_.tokens().front(); }
    std::int64_t total() const { return budget_; }

  protected:
    Shape shape_;
    oracle::TokenServer tokens_;
    std::int64_t budget_;
};

/// Premature replenishment, the defect of POSIX: what is left keeps an old activation instant over
/// an idle time, so that using it late brings it back too soon.
struct PrematureReplenishment : TokenMutant {
    using TokenMutant::TokenMutant;
    void unblock(std::int64_t) override {}
};

/// Replenishment one period after the server woke, not after the chunk became active.
struct OneActivationForAll : TokenMutant {
    using TokenMutant::TokenMutant;
    void unblock(std::int64_t now) override {
        woke_ = now;
        TokenMutant::unblock(now);
    }
    void consume(std::int64_t, std::int64_t used) override {
        auto tokens = tokens_.tokens();
        for (; used > 0; --used) {
            tokens.pop_front();
            tokens.push_back(std::max(woke_ + shape_.period, tokens.empty() ? 0 : tokens.back()));
        }
        tokens_.set_tokens(tokens);
    }
    std::int64_t woke_ = 0;
};

/// An overrun is not charged.
struct ForgivenOverrun : TokenMutant {
    using TokenMutant::TokenMutant;
    void consume(std::int64_t end, std::int64_t used) override {
        TokenMutant::consume(end, std::min(used, available(end - used)));
    }
};

/// When two pieces must become one, the later is taken early.
struct MergeAdvances : TokenMutant {
    using TokenMutant::TokenMutant;
    void consume(std::int64_t end, std::int64_t used) override {
        TokenMutant::consume(end, used);
        auto tokens = tokens_.tokens();
        std::size_t pieces = 1;
        for (std::size_t k = 1; k < tokens.size(); ++k) {
            if (tokens[k] == tokens[k - 1] + 1) continue;
            if (++pieces > shape_.refill_limit) tokens[k] = tokens[k - 1] + 1;
        }
        tokens_.set_tokens(tokens);
    }
};

/// The list of refills loses a token now and then (amounts do not add up).
struct LeakyServer : RealServer {
    using RealServer::RealServer;
    std::int64_t total() const { return RealServer::total() - (++asked_ % 64 == 0 ? 1 : 0); }
    mutable int asked_ = 0;
};

// ---- the run ------------------------------------------------------------------------------------

struct Outcome {
    Ran ran;
    std::optional<std::string> broken;  // an invariant that failed on the way
};

template <typename Server>
Outcome run_alone(const Shape& shape, std::uint64_t seed, std::int64_t ticks) {
    std::mt19937_64 random{seed};
    const auto pick = [&](std::int64_t low, std::int64_t high) {
        return std::uniform_int_distribution<std::int64_t>{low, high}(random);
    };
    Server server{shape};
    Outcome outcome{Ran(static_cast<std::size_t>(ticks + 4 * shape.period), 0), std::nullopt};
    std::int64_t now = 0;
    while (now < ticks) {
        now += pick(0, 3) == 0 ? pick(1, 3 * shape.period) : pick(0, shape.period / 4);
        server.unblock(now);
        std::int64_t work = pick(0, 9) == 0 ? 5 * shape.budget : pick(1, shape.budget);
        while (work > 0 && now < ticks) {
            const std::int64_t available = server.available(now);
            if (available == 0) {
                now = std::max(now + 1, server.next());
                continue;
            }
            std::int64_t run = std::min(work, available);
            if (run < work) run += std::min(work - run, pick(0, shape.overrun_most));
            std::fill_n(outcome.ran.begin() + now, run, 1);
            now += run;
            work -= run;
            server.consume(now, run);
            if (server.total() != shape.budget) outcome.broken = "the refills do not sum to the budget";
        }
        server.block(now);
    }
    return outcome;
}

// ---- the properties: empty when they hold -------------------------------------------------------

/// In every window of k periods at most k budgets; and where enforcement comes late, one overrun
/// more, not k: only the last one in the window has not been paid back in it.
std::string window_violation(const Shape& shape, const Ran& ran) {
    for (const std::int64_t k : {1, 2, 5, 20, 100}) {
        const std::int64_t most = most_in_window(ran, k * shape.period);
        if (most > k * shape.budget + shape.overrun_most) {
            return std::to_string(most) + " in a window of " + std::to_string(k) + " periods";
        }
    }
    return {};
}

/// Never replenished early: whoever runs for the (C + k)-th time does so a period after the k-th,
/// at least.
std::string replenishment_violation(const Shape& shape, const Ran& ran) {
    std::vector<std::int64_t> ticks;
    for (std::size_t t = 0; t < ran.size(); ++t) {
        if (ran[t]) ticks.push_back(static_cast<std::int64_t>(t));
    }
    for (std::size_t k = 0; k + static_cast<std::size_t>(shape.budget) < ticks.size(); ++k) {
        const std::int64_t again = ticks[k + static_cast<std::size_t>(shape.budget)];
        if (again < ticks[k] + shape.period) {
            return "used at " + std::to_string(ticks[k]) + ", and again at " + std::to_string(again);
        }
    }
    return {};
}

template <typename Server>
std::string violation(const Shape& shape, std::uint64_t seed) {
    const Outcome outcome = run_alone<Server>(shape, seed, 200 * shape.period);
    if (outcome.broken) return *outcome.broken;
    const std::string window = window_violation(shape, outcome.ran);
    return window.empty() && shape.overrun_most == 0 ? replenishment_violation(shape, outcome.ran) : window;
}

Shape random_shape(std::uint64_t seed, std::int64_t overrun_most) {
    std::mt19937_64 random{seed};
    const auto pick = [&](std::int64_t low, std::int64_t high) {
        return std::uniform_int_distribution<std::int64_t>{low, high}(random);
    };
    const std::int64_t budget = pick(2, 60);
    const std::int64_t period = pick(0, 4) == 0 ? budget : budget + pick(1, 300);
    const std::size_t limit = static_cast<std::size_t>(pick(1, RefillQueue::kCapacity));
    return {budget, period, limit, std::min(overrun_most, period - 1)};
}

/// How many of the seeds catch the server.
template <typename Server>
int caught(std::int64_t overrun_most) {
    int count = 0;
    for (std::uint64_t seed = 1; seed <= 60; ++seed) {
        count += violation<Server>(random_shape(seed, overrun_most), seed).empty() ? 0 : 1;
    }
    return count;
}

TEST(SporadicServerProperty, EveryWindowHoldsAtMostTheBudget) {
    for (std::uint64_t seed = 1; seed <= 400; ++seed) {
        const Shape shape = random_shape(seed, 0);
        ASSERT_EQ(violation<RealServer>(shape, seed), "") << "seed " << seed;
    }
}

TEST(SporadicServerProperty, OverrunsArePaidBack) {
    for (std::uint64_t seed = 1; seed <= 400; ++seed) {
        const Shape shape = random_shape(seed, 9);
        ASSERT_EQ(violation<RealServer>(shape, seed), "") << "seed " << seed;
    }
}

/// The promise upwards: a server that always has work gets its whole budget in every period, on a
/// free core.
TEST(SporadicServerProperty, ABusyServerGetsItsWholeBudget) {
    for (std::uint64_t seed = 1; seed <= 100; ++seed) {
        const Shape shape = random_shape(seed, 0);
        SporadicServer server{{Nanoseconds{shape.budget}, Nanoseconds{shape.period}}};
        server.unblock(kEpoch);
        Instant now = kEpoch;
        for (std::int64_t k = 0; k < 50; ++k) {
            const Nanoseconds used = server.available(now);
            ASSERT_GT(used, 0ns);
            now += used;
            server.consume(now, used);
            now = std::max(now, server.next_replenishment());
        }
        const std::int64_t periods = to_ns(now) / shape.period;
        ASSERT_GE(server.consumed().count(), periods * shape.budget) << "seed " << seed;
    }
}

TEST(SporadicServerProperty, CatchesPrematureReplenishment) {
    EXPECT_GT(caught<PrematureReplenishment>(0), 40);
}
TEST(SporadicServerProperty, CatchesOneActivationForAll) { EXPECT_GT(caught<OneActivationForAll>(0), 40); }
TEST(SporadicServerProperty, CatchesForgivenOverruns) { EXPECT_GT(caught<ForgivenOverrun>(9), 40); }
TEST(SporadicServerProperty, CatchesAMergeThatAdvances) { EXPECT_GT(caught<MergeAdvances>(0), 10); }
TEST(SporadicServerProperty, CatchesALeak) { EXPECT_EQ(caught<LeakyServer>(0), 60); }
/// The mutants are wrong by their one broken rule: without it they are not caught.
TEST(SporadicServerProperty, DoesNotCatchTheUnbrokenTokens) { EXPECT_EQ(caught<TokenMutant>(9), 0); }

}  // namespace
}  // namespace qduino::sched::sporadic_server_property_test
