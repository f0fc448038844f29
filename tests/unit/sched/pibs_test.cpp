#include "sched/pibs.h"

#include <gtest/gtest.h>

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
