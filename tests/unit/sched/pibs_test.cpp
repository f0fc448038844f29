#include "sched/pibs.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/unit/sched/make.h"

namespace qduino::sched::pibs_test {
namespace {

/// The drawing at the head of pibs.h: U = 1/4, a client of period 16.
TEST(Pibs, UsedAllComesBackOnePeriodAfterItBecameEligible) {
    Pibs server{{1ns, 4ns}};
    server.activate(at_ns(100), 16ns);
    EXPECT_EQ(server.client_period(), 16ns);
    EXPECT_EQ(server.available(at_ns(100)), 4ns);
    server.consume(at_ns(104), 4ns);
    EXPECT_EQ(server.available(at_ns(115)), 0ns);
    EXPECT_EQ(server.next_replenishment(), at_ns(116));
    EXPECT_EQ(server.available(at_ns(116)), 4ns);
}

TEST(Pibs, UsedInPartComesBackSooner) {
    Pibs server{{1ns, 4ns}};
    server.activate(at_ns(100), 16ns);
    server.consume(at_ns(101), 1ns);
    EXPECT_EQ(server.available(at_ns(101)), 3ns);
    server.block(at_ns(101));
    EXPECT_TRUE(server.blocked());
    server.activate(at_ns(102), 16ns);
    EXPECT_EQ(server.available(at_ns(103)), 0ns);
    EXPECT_EQ(server.next_replenishment(), at_ns(104));
    EXPECT_EQ(server.available(at_ns(104)), 4ns);
}

/// A holder of a lock goes on without budget: in however many pieces that is charged, it begins no
/// further service, each of which would pay for an activation.
TEST(Pibs, AnOverrunInPiecesComesBackAsOneInOnePieceDoes) {
    for (const Nanoseconds piece : {1ns, 5ns, 10ns}) {
        Pibs server{{2ns, 7ns}, at_ns(0), 1ns};
        server.activate(at_ns(100), 14ns);
        EXPECT_EQ(server.consume(at_ns(103), 3ns), 0ns);
        EXPECT_EQ(server.next_replenishment(), at_ns(114));
        for (Nanoseconds end = piece; end <= 30ns; end += piece)
            EXPECT_EQ(server.consume(at_ns(103) + end, piece), piece);
        // 1 of activation, 3 and 30: 34 · 7/2.
        EXPECT_EQ(server.next_replenishment(), at_ns(100 + 119));
        EXPECT_EQ(server.available(at_ns(100 + 119)), 3ns);
    }
}

/// A late timer lets a handler run on until its replenishment is past.
TEST(Pibs, APieceThatReachesBeyondTheReplenishmentIsNoService) {
    Pibs server{{1ns, 4ns}, at_ns(0)};
    server.activate(at_ns(0), 16ns);
    EXPECT_EQ(server.consume(at_ns(4), 4ns), 0ns);
    EXPECT_EQ(server.next_replenishment(), at_ns(16));
    EXPECT_EQ(server.consume(at_ns(18), 3ns), 3ns) << "one before it, two behind it";
    EXPECT_EQ(server.next_replenishment(), at_ns(28)) << "all three without budget";
    EXPECT_EQ(server.available(at_ns(18)), 0ns);
    EXPECT_EQ(server.available(at_ns(28)), 4ns);
}

/// One that was held up for so long that its next service may follow at once.
TEST(Pibs, APieceThatReachesIntoTheNextServiceIsChargedToBoth) {
    Pibs server{{1ns, 4ns}, at_ns(0)};
    server.activate(at_ns(0), 16ns);
    EXPECT_EQ(server.consume(at_ns(106), 6ns), 0ns) << "four of the one, two of the other";
    EXPECT_EQ(server.available(at_ns(106)), 2ns) << "and not four";
    EXPECT_EQ(server.consume(at_ns(110), 4ns), 2ns);
    EXPECT_EQ(server.next_replenishment(), at_ns(104 + 24)) << "which began at 104";
}

TEST(Pibs, PiecesDoNotMatter) {
    for (std::uint64_t seed = 1; seed <= 2000; ++seed) {
        std::mt19937_64 random{seed};
        const auto pick = [&](std::int64_t low, std::int64_t high) {
            return std::uniform_int_distribution<std::int64_t>{low, high}(random);
        };
        const std::int64_t period = pick(1, 12), budget = pick(1, period);
        std::int64_t now = pick(0, 30);
        Pibs whole{{Nanoseconds{budget}, Nanoseconds{period}}, at_ns(0), Nanoseconds{pick(0, 2)}};
        whole.activate(at_ns(now), Nanoseconds{pick(1, 40)});
        now += pick(0, 60);  // it is held up
        for (int piece = 0; piece < 6; ++piece) {
            Pibs ticks = whole;
            const std::int64_t used = pick(0, 14);
            const Nanoseconds overrun = whole.consume(at_ns(now + used), Nanoseconds{used});
            Nanoseconds of_ticks{};
            for (std::int64_t tick = 1; tick <= used; ++tick)
                of_ticks += ticks.consume(at_ns(now + tick), 1ns);
            now += used;
            ASSERT_EQ(overrun, of_ticks) << "seed " << seed;
            ASSERT_EQ(whole.next_replenishment(), ticks.next_replenishment()) << "seed " << seed;
            ASSERT_EQ(whole.available(at_ns(now)), ticks.available(at_ns(now))) << "seed " << seed;
            now += pick(0, 2 * period);
        }
    }
}

/// The service behind one that has used its whole budget, or more, may never begin: the work is
/// done. Nothing turned to it, so it has no activation to pay for.
TEST(Pibs, AServiceThatNeverBeganPaysForNoActivation) {
    Pibs server{{2ns, 7ns}, at_ns(0), 1ns};
    server.activate(at_ns(100), 14ns);
    server.consume(at_ns(103), 3ns);
    server.block(at_ns(103));
    EXPECT_EQ(server.next_replenishment(), at_ns(114)) << "1 of activation and 3 used: 4 * 7/2";
    server.activate(at_ns(103), 14ns);
    server.consume(at_ns(105), 2ns);
    server.block(at_ns(105));
    EXPECT_EQ(server.next_replenishment(), at_ns(121)) << "and 2 beyond the budget: 6 * 7/2";
    server.activate(at_ns(105), 14ns);
    EXPECT_EQ(server.available(at_ns(120)), 0ns);
    EXPECT_EQ(server.available(at_ns(121)), 3ns);
    server.block(at_ns(121));
    EXPECT_EQ(server.next_replenishment(), at_ns(125)) << "it could begin, and pays";
}

TEST(Pibs, IdleTimeIsNotSavedUp) {
    Pibs server{{1ns, 4ns}};
    server.activate(at_ns(1000), 16ns);
    server.consume(at_ns(1004), 4ns);
    EXPECT_EQ(server.next_replenishment(), at_ns(1016));
}

TEST(Pibs, AShorterClientRaisesAndClamps) {
    Pibs server{{1ns, 4ns}};
    server.activate(at_ns(0), 400ns);
    EXPECT_EQ(server.available(at_ns(0)), 100ns);
    server.consume(at_ns(10), 10ns);
    server.activate(at_ns(10), 40ns);
    EXPECT_EQ(server.client_period(), 40ns);
    EXPECT_EQ(server.available(at_ns(10)), 10ns);
    server.consume(at_ns(20), 10ns);
    // 10/U for the old client, then 10/U for the new one.
    EXPECT_EQ(server.next_replenishment(), at_ns(80));
}

TEST(Pibs, ARaiseNeverAddsBudget) {
    Pibs server{{1ns, 4ns}};
    server.activate(at_ns(0), 400ns);
    server.consume(at_ns(97), 97ns);
    server.activate(at_ns(97), 40ns);
    EXPECT_EQ(server.available(at_ns(97)), 3ns);
}

TEST(Pibs, AServiceHeldUpForLongIsChargedFromItsRaise) {
    Pibs server{{1ns, 4ns}};
    server.activate(at_ns(0), 400ns);
    // Nothing run since 0: at the new priority it is a fresh start.
    server.activate(at_ns(300), 40ns);
    server.consume(at_ns(310), 10ns);
    EXPECT_EQ(server.next_replenishment(), at_ns(340));
}

TEST(Pibs, ALongerClientChangesNothing) {
    Pibs server{{1ns, 4ns}};
    server.activate(at_ns(0), 40ns);
    server.activate(at_ns(1), 400ns);
    EXPECT_EQ(server.client_period(), 40ns);
    EXPECT_EQ(server.available(at_ns(1)), 10ns);
}

TEST(Pibs, AnOverrunMovesTheReplenishment) {
    Pibs server{{1ns, 4ns}};
    server.activate(at_ns(0), 16ns);
    server.consume(at_ns(7), 7ns);
    EXPECT_EQ(server.next_replenishment(), at_ns(28));
    server.block(at_ns(7));
    EXPECT_EQ(server.next_replenishment(), at_ns(28));
    server.consume(at_ns(8), 1ns);  // on its way to sleep
    EXPECT_EQ(server.next_replenishment(), at_ns(32));
    EXPECT_EQ(server.consumed(), 8ns);
}

TEST(Pibs, AChangeEndsTheServiceAndWhatItUsedComesBackAtTheOldShare) {
    Pibs server{{1ns, 4ns}};
    server.activate(at_ns(0), 16ns);
    server.consume(at_ns(2), 2ns);
    server.change(at_ns(2), {1ns, 2ns});
    EXPECT_EQ(server.available(at_ns(7)), 0ns);
    EXPECT_EQ(server.next_replenishment(), at_ns(8)) << "2 at a quarter";
    EXPECT_EQ(server.available(at_ns(8)), 8ns) << "half of 16";
}

TEST(Pibs, AChangeBeforeAServiceBeginsCostsItNothing) {
    Pibs server{{1ns, 4ns}};
    server.activate(at_ns(0), 16ns);
    server.consume(at_ns(4), 4ns);
    for (int i = 0; i < 3; ++i) server.change(at_ns(5 + i), {1ns, 8ns});
    EXPECT_EQ(server.next_replenishment(), at_ns(16));
    EXPECT_EQ(server.available(at_ns(16)), 2ns);
    server.block(at_ns(16));
    server.change(at_ns(20), {1ns, 4ns});
    server.activate(at_ns(20), 16ns);
    EXPECT_EQ(server.available(at_ns(20)), 4ns);
}

TEST(Pibs, RoundsAgainstTheServer) {
    const Pibs server{{1ns, 3ns}};
    EXPECT_EQ(server.budget_for(10ns), 3ns);
    EXPECT_EQ(server.budget_for(2ns), 1ns);
    EXPECT_EQ(server.recovery_of(3ns), 9ns);
    const Pibs odd{{3ns, 10ns}};
    EXPECT_EQ(odd.recovery_of(1ns), 4ns);
}

TEST(PibsDeathTest, ContractsHold) {
    EXPECT_DEATH((Pibs{{2ns, 1ns}}), "contract broken");
    EXPECT_DEATH((Pibs{{1ns, 2ns}}.activate(at_ns(0), 0ns)), "contract broken");
    EXPECT_DEATH(static_cast<void>(Pibs{{1ns, 2ns}}.client_period()), "contract broken");
    EXPECT_DEATH((Pibs{{1ns, 2ns}}.change(at_ns(0), {2ns, 1ns})), "contract broken");
    EXPECT_DEATH((Pibs{{1ns, 2ns}}.consume(at_ns(0), -1ns)), "contract broken");
}

}  // namespace
}  // namespace qduino::sched::pibs_test
