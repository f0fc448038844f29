// An I/O VCPU's promise to lower priorities, on long random runs; and wrong servers, which must be
// caught.
//
// Window bound: at the priority of client period T and higher, in every window of length t >= U·T
// it runs at most U·(t − U·T) + U·T. The levels are checked one by one while clients come and go at
// random and raise it in mid-service. At the lowest level it is held up at random, as if something
// of higher priority ran.

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <string>

#include "sched/pibs.h"
#include "tests/property/sched/windows.h"

namespace qduino::sched::pibs_property_test {
namespace {

struct Shape {
    std::int64_t budget;
    std::int64_t period;
    std::array<std::int64_t, 3> clients;  // periods, shortest first; held up only at the last
    std::int64_t overrun_most = 0;
    std::int64_t lowered_to = 0;  // the budget, half-way and for good; 0: it is not
    bool changes = false;         // it may have any budget up to `budget`, ever again
};

// ---- servers ------------------------------------------------------------------------------------

class RealServer {
  public:
    explicit RealServer(const Shape& shape)
        : server_({Nanoseconds{shape.budget}, Nanoseconds{shape.period}}) {}
    void activate(std::int64_t now, std::int64_t client) {
        server_.activate(instant_from_ns(now), Nanoseconds{client});
    }
    void block(std::int64_t now) { server_.block(instant_from_ns(now)); }
    void change(std::int64_t now, std::int64_t budget) {
        const Nanoseconds period = server_.parameters().period;
        server_.change(instant_from_ns(now), {Nanoseconds{budget}, period});
    }
    void consume(std::int64_t end, std::int64_t used) {
        server_.consume(instant_from_ns(end), Nanoseconds{used});
    }
    std::int64_t available(std::int64_t now) const { return server_.available(instant_from_ns(now)).count(); }
    std::int64_t client() const { return server_.client_period().count(); }

  private:
    Pibs server_;
};

/// The rules written down once more, so that each can be broken.
struct Rules {
    bool clamp_on_raise = true;          // remaining <= U·T_new
    bool charge_from_raise = true;       // what follows the raise comes back counted from it
    bool charge_overrun = true;          // used beyond the budget moves the replenishment
    bool replenish_at_used_by_u = true;  // not sooner
    bool change_ends_service = true;     // what it used comes back at the old U
};

template <Rules kRules>
class Variant {
  public:
    explicit Variant(const Shape& shape) : budget_(shape.budget), period_(shape.period) {}
    void activate(std::int64_t now, std::int64_t client) {
        if (!active_) {
            active_ = true;
            client_ = client;
            open(now);
        } else if (client < client_) {
            client_ = client;
            if (kRules.clamp_on_raise) remaining_ = std::min(remaining_, share());
            if (!kRules.charge_from_raise || eligible_ > now) return;
            base_ = std::max(now, base_ + recovery());
            used_ = 0;
        }
    }
    void block(std::int64_t) {
        if (!active_) return;
        active_ = false;
        close();
    }
    void change(std::int64_t now, std::int64_t budget) {
        const bool ends = active_ && eligible_ < now && kRules.change_ends_service;
        if (ends) close();
        budget_ = budget;
        if (ends || (active_ && eligible_ >= now)) open(now);
    }
    void consume(std::int64_t end, std::int64_t used) {
        used_ += kRules.charge_overrun ? used : std::min(used, remaining_);
        remaining_ -= used;
        if (remaining_ > 0) return;
        close();
        open(end);
    }
    std::int64_t available(std::int64_t now) const { return active_ && eligible_ <= now ? remaining_ : 0; }
    std::int64_t client() const { return client_; }

  private:
    std::int64_t share() const { return std::max<std::int64_t>(budget_ * client_ / period_, 1); }
    std::int64_t recovery() const {
        return kRules.replenish_at_used_by_u ? (used_ * period_ + budget_ - 1) / budget_ : used_;
    }
    void open(std::int64_t now) {
        eligible_ = base_ = std::max(eligible_, now);
        remaining_ = share();
        used_ = 0;
    }
    void close() {
        eligible_ = base_ = base_ + recovery();
        used_ = 0;
    }

    std::int64_t budget_, period_;
    std::int64_t eligible_ = 0, base_ = 0, client_ = 0, remaining_ = 0, used_ = 0;
    bool active_ = false;
};

using Correct = Variant<Rules{}>;
using UnclampedRaise = Variant<Rules{.clamp_on_raise = false}>;
using RaiseChargedFromBefore = Variant<Rules{.charge_from_raise = false}>;
using ForgivenOverrun = Variant<Rules{.charge_overrun = false}>;
using ChangeInMidService = Variant<Rules{.change_ends_service = false}>;
using PrematureReplenishment = Variant<Rules{.replenish_at_used_by_u = false}>;

// ---- the run ------------------------------------------------------------------------------------

/// What ran at the level of client c or above, for each c.
using RanByLevel = std::array<Ran, 3>;

/// Work that comes and goes, tick by tick. `single_client`: only the shortest; no raises, never
/// held up.
template <typename Server>
class LoneRun {
  public:
    LoneRun(const Shape& shape, std::uint64_t seed, bool single_client)
        : shape_(shape), random_(seed), single_client_(single_client), server_(shape) {}

    RanByLevel run(std::int64_t ticks) {
        RanByLevel ran;
        for (Ran& level : ran) level.assign(static_cast<std::size_t>(ticks), 0);
        for (std::int64_t now = 0; now < ticks; ++now) {
            if (shape_.lowered_to > 0 && now == ticks / 2) change(now, shape_.lowered_to);
            if (shape_.changes && pick(0, shape_.clients[1]) == 0) change(now, pick(1, shape_.budget));
            if (pick(0, shape_.clients[0]) == 0) arrive(now);
            if (work_ == 0 || !dispatched(now)) continue;
            for (std::size_t c = 0; c < 3; ++c) {
                ran[c][static_cast<std::size_t>(now)] = server_.client() <= shape_.clients[c];
            }
            run_one(now);
        }
        return ran;
    }

  private:
    std::int64_t pick(std::int64_t low, std::int64_t high) {
        return std::uniform_int_distribution<std::int64_t>{low, high}(random_);
    }
    void arrive(std::int64_t now) {
        const std::int64_t client = shape_.clients[single_client_ ? 0 : static_cast<std::size_t>(pick(0, 2))];
        charge(now);
        server_.activate(now, client);
        work_ +=
            pick(0, 4) == 0 ? shape_.clients[2] / 4 : pick(1, 1 + client * shape_.budget / shape_.period);
    }
    void change(std::int64_t now, std::int64_t budget) {
        charge(now);
        server_.change(now, budget);
    }
    /// Runs already, or may begin to: then until its budget ends, and a little longer when
    /// enforcement is late.
    bool dispatched(std::int64_t now) {
        const bool may_be_held = server_.client() == shape_.clients[2] && !single_client_;
        if (may_be_held && now >= held_until_ && pick(0, 99) == 0)
            held_until_ = now + pick(1, 2 * shape_.clients[2]);
        if (may_be_held && now < held_until_) return charge(now), false;
        if (uncharged_ > 0) return true;
        const std::int64_t available = server_.available(now);
        enforced_after_ = available + pick(0, shape_.overrun_most);
        return available > 0;
    }
    void run_one(std::int64_t now) {
        --work_;
        ++uncharged_;
        if (work_ == 0 || uncharged_ == enforced_after_) charge(now + 1);
        if (work_ == 0) server_.block(now + 1);
    }
    void charge(std::int64_t now) {
        if (uncharged_ > 0) server_.consume(now, uncharged_);
        uncharged_ = 0;
    }

    Shape shape_;
    std::mt19937_64 random_;
    bool single_client_;
    Server server_;
    std::int64_t work_ = 0;
    std::int64_t held_until_ = 0;
    std::int64_t uncharged_ = 0;
    std::int64_t enforced_after_ = 0;
};

// ---- the property: empty when it holds ----------------------------------------------------------

/// U·(t − U·T) + U·T in whole ticks, and the overrun of the last service.
std::int64_t window_bound(const Shape& shape, std::int64_t client, std::int64_t length) {
    const std::int64_t b = shape.budget;
    const std::int64_t p = shape.period;
    return (b * p * length + b * (p - b) * client) / (p * p) + shape.overrun_most;
}

std::string window_violation(const Shape& shape, const RanByLevel& ran) {
    for (std::size_t c = 0; c < 3; ++c) {
        const std::int64_t client = shape.clients[c];
        for (std::int64_t length = client * shape.budget / shape.period + shape.overrun_most;
             length <= 20 * shape.clients[2]; length += 1 + length / 3) {
            const std::int64_t most = most_in_window(ran[c], length);
            if (most > window_bound(shape, client, length)) {
                return std::to_string(most) + " at level " + std::to_string(client) + " in a window of " +
                       std::to_string(length);
            }
        }
        // At the lowest level it was held up: what it had coming may come late, and at once.
        if (c == 1) break;
    }
    return {};
}

Shape random_shape(std::uint64_t seed, std::int64_t overrun_most) {
    std::mt19937_64 random{seed};
    const auto pick = [&](std::int64_t low, std::int64_t high) {
        return std::uniform_int_distribution<std::int64_t>{low, high}(random);
    };
    const std::int64_t period = pick(2, 12);
    const std::int64_t shortest = period * pick(2, 8);
    const std::int64_t middle = shortest * pick(1, 4);
    return {pick(1, period - 1), period, {shortest, middle, middle * pick(2, 8)}, overrun_most};
}

/// A budget that is lowered half-way binds every window after that.
template <typename Server>
std::string violation_after_lowering(std::uint64_t seed) {
    Shape shape = random_shape(seed, 0);
    shape.lowered_to = 1 + shape.budget / 3;
    RanByLevel ran = LoneRun<Server>{shape, seed, false}.run(200 * shape.clients[1]);
    for (Ran& level : ran) level.erase(level.begin(), level.begin() + std::ssize(level) / 2);
    shape.budget = shape.lowered_to;
    return window_violation(shape, ran);
}

/// Whatever it is changed to, and when: it takes no more than a server that always had the most.
template <typename Server>
std::string violation_with_changes(std::uint64_t seed) {
    Shape shape = random_shape(seed, 0);
    shape.changes = true;
    return window_violation(shape, LoneRun<Server>{shape, seed, false}.run(200 * shape.clients[1]));
}

template <typename Server>
std::string violation(std::uint64_t seed, std::int64_t overrun_most, bool single_client) {
    const Shape shape = random_shape(seed, overrun_most);
    return window_violation(shape, LoneRun<Server>{shape, seed, single_client}.run(200 * shape.clients[1]));
}

/// How many of 100 seeds catch the server.
template <typename Server>
int caught(std::int64_t overrun_most, bool single_client) {
    int count = 0;
    for (std::uint64_t seed = 1; seed <= 100; ++seed) {
        count += violation<Server>(seed, overrun_most, single_client).empty() ? 0 : 1;
    }
    return count;
}

TEST(PibsProperty, EveryWindowIsBoundedForOneClient) {
    for (std::uint64_t seed = 1; seed <= 300; ++seed) {
        ASSERT_EQ(violation<RealServer>(seed, 0, true), "") << "seed " << seed;
    }
}

TEST(PibsProperty, EveryWindowIsBoundedAtEveryLevelWhenClientsRaiseIt) {
    for (std::uint64_t seed = 1; seed <= 300; ++seed) {
        ASSERT_EQ(violation<RealServer>(seed, 0, false), "") << "seed " << seed;
    }
}

TEST(PibsProperty, OverrunsArePaidBack) {
    for (std::uint64_t seed = 1; seed <= 300; ++seed) {
        ASSERT_EQ(violation<RealServer>(seed, 5, true), "") << "seed " << seed;
    }
}

TEST(PibsProperty, AChangedServerTakesNoMoreThanOneThatAlwaysHadTheGreatestBudget) {
    for (std::uint64_t seed = 1; seed <= 300; ++seed) {
        ASSERT_EQ(violation_with_changes<RealServer>(seed), "") << "seed " << seed;
    }
}

TEST(PibsProperty, ALoweredServerKeepsToItsNewBudgetFromThenOn) {
    for (std::uint64_t seed = 1; seed <= 300; ++seed) {
        ASSERT_EQ(violation_after_lowering<RealServer>(seed), "") << "seed " << seed;
        ASSERT_EQ(violation_after_lowering<Correct>(seed), "") << "seed " << seed;
    }
}

TEST(PibsProperty, CatchesAChangeInMidService) {
    int count = 0;
    for (std::uint64_t seed = 1; seed <= 300; ++seed) {
        count += violation_after_lowering<ChangeInMidService>(seed).empty() ? 0 : 1;
    }
    EXPECT_GT(count, 10);
}

TEST(PibsProperty, CatchesAnUnclampedRaise) { EXPECT_GT(caught<UnclampedRaise>(0, false), 30); }
TEST(PibsProperty, CatchesARaiseThatIsChargedFromBefore) {
    EXPECT_GT(caught<RaiseChargedFromBefore>(0, false), 10);
}
TEST(PibsProperty, CatchesForgivenOverruns) { EXPECT_GT(caught<ForgivenOverrun>(5, true), 50); }
TEST(PibsProperty, CatchesPrematureReplenishment) { EXPECT_GT(caught<PrematureReplenishment>(0, true), 50); }
/// The mutants are wrong by their one broken rule: with all rules kept nothing is caught.
TEST(PibsProperty, DoesNotCatchTheUnbrokenRules) { EXPECT_EQ(caught<Correct>(5, false), 0); }

}  // namespace
}  // namespace qduino::sched::pibs_property_test
