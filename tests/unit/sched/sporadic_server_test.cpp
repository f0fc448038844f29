#include "sched/sporadic_server.h"

#include <gmock/gmock.h>

#include "tests/unit/sched/make.h"

namespace qduino::sched::sporadic_server_test {
namespace {

using ::testing::ElementsAre;

TEST(SporadicServer, StartsFullAndBlocked) {
    const SporadicServer server{{3ns, 10ns}, at_ns(5)};
    EXPECT_TRUE(server.blocked());
    EXPECT_EQ(server.total(), 3ns);
    EXPECT_FALSE(server.eligible(at_ns(4)));
    EXPECT_EQ(server.available(at_ns(4)), 0ns);
    EXPECT_EQ(server.available(at_ns(5)), 3ns);
    EXPECT_EQ(server.next_replenishment(), at_ns(5));
}

/// The drawing at the head of sporadic_server.h.
TEST(SporadicServer, EachChunkComesBackOnePeriodAfterItBecameActive) {
    SporadicServer server{{3ns, 10ns}};
    server.unblock(at_ns(0));
    server.consume(at_ns(1), 1ns);
    server.block(at_ns(1));
    server.unblock(at_ns(5));
    server.consume(at_ns(7), 2ns);
    EXPECT_EQ(server.available(at_ns(9)), 0ns);
    EXPECT_EQ(server.next_replenishment(), at_ns(10));
    EXPECT_EQ(server.available(at_ns(10)), 1ns);
    server.consume(at_ns(11), 1ns);
    EXPECT_EQ(server.next_replenishment(), at_ns(15));
    EXPECT_EQ(server.available(at_ns(15)), 2ns);
}

TEST(SporadicServer, APreemptedServerKeepsTheInstantItBecameActive) {
    SporadicServer server{{4ns, 20ns}};
    server.unblock(at_ns(0));
    server.consume(at_ns(19), 4ns);  // held up until 15, as a periodic task would be
    EXPECT_EQ(server.next_replenishment(), at_ns(20));
}

TEST(SporadicServer, AnIdleServerDoesNotSaveUp) {
    SporadicServer server{{4ns, 20ns}};
    server.unblock(at_ns(100));
    EXPECT_EQ(server.available(at_ns(100)), 4ns);
    server.consume(at_ns(104), 4ns);
    EXPECT_EQ(server.next_replenishment(), at_ns(120));
}

TEST(SporadicServer, UnblockingTwiceChangesNothing) {
    SporadicServer server{{4ns, 20ns}};
    server.unblock(at_ns(0));
    server.unblock(at_ns(10));
    EXPECT_THAT(server.refills(), ElementsAre(Refill{at_ns(0), 4ns}));
}

TEST(SporadicServer, AnOverrunIsChargedForwardAndReported) {
    SporadicServer server{{4ns, 20ns}};
    server.unblock(at_ns(0));
    EXPECT_EQ(server.consume(at_ns(4), 4ns), 0ns);
    EXPECT_EQ(server.consume(at_ns(7), 3ns), 3ns);
    EXPECT_THAT(server.refills(), ElementsAre(Refill{at_ns(23), 1ns}, Refill{at_ns(40), 3ns}));
    EXPECT_EQ(server.consumed(), 7ns);
}

TEST(SporadicServer, AnOverrunOfManyBudgetsIsPaidInFull) {
    SporadicServer server{{4ns, 20ns}};
    server.unblock(at_ns(0));
    EXPECT_EQ(server.consume(at_ns(401), 401ns), 397ns);
    EXPECT_THAT(server.refills(), ElementsAre(Refill{at_ns(2001), 3ns}, Refill{at_ns(2020), 1ns}));
}

TEST(SporadicServer, WhatIsUsedOnTheWayToSleepIsPaid) {
    SporadicServer server{{4ns, 20ns}};
    server.unblock(at_ns(0));
    server.block(at_ns(0));
    server.consume(at_ns(1), 1ns);
    EXPECT_THAT(server.refills(), ElementsAre(Refill{at_ns(1), 3ns}, Refill{at_ns(20), 1ns}));
}

TEST(SporadicServer, TheWholePeriodIsNeverThrottled) {
    SporadicServer server{{10ns, 10ns}};
    server.unblock(at_ns(0));
    for (int i = 1; i <= 1000; ++i) {
        EXPECT_GE(server.available(at_ns(i - 1)), 1ns);
        server.consume(at_ns(i), 1ns);
    }
}

TEST(SporadicServer, SplintersAreHeldBackWhenAsked) {
    SporadicServer server{{9ns, 100ns}, kEpoch, {.refill_limit = 4, .shortest_run = 2ns}};
    server.unblock(at_ns(0));
    server.consume(at_ns(8), 8ns);
    EXPECT_EQ(server.available(at_ns(8)), 0ns);
    EXPECT_EQ(server.next_replenishment(), at_ns(99));
    EXPECT_EQ(server.total(), 9ns);
}

/// A loop that never waits pays for each sleep with its budget. So a gap that is not worth a sleep
/// must not stay: its refills would come back as it left them.
TEST(SporadicServer, OfRunsThatNearlyTouchAThrottledOneWaitsForAll) {
    SporadicServer server{{9ns, 100ns}, kEpoch, {.refill_limit = 4, .shortest_run = 2ns}};
    server.unblock(at_ns(0));
    server.consume(at_ns(3), 3ns);
    server.block(at_ns(3));
    server.unblock(at_ns(4));  // {4,6} {100,3}
    server.consume(at_ns(10), 6ns);
    EXPECT_THAT(server.refills(), ElementsAre(Refill{at_ns(101), 9ns})) << "and not {100,3} {104,6}";
    EXPECT_EQ(server.available(at_ns(101)), 9ns);
}

TEST(SporadicServer, ARunThatIsDueIsNotHeldBackForAGap) {
    SporadicServer server{{9ns, 100ns}, kEpoch, {.refill_limit = 4, .shortest_run = 2ns}};
    server.unblock(at_ns(0));
    server.consume(at_ns(3), 3ns);
    server.block(at_ns(3));
    server.unblock(at_ns(93));  // {93,6} {100,3}
    EXPECT_EQ(server.available(at_ns(93)), 6ns);
    server.consume(at_ns(94), 1ns);
    EXPECT_EQ(server.available(at_ns(94)), 5ns);
}

TEST(SporadicServerDeathTest, ContractsHold) {
    EXPECT_DEATH((SporadicServer{{11ns, 10ns}}), "contract broken");
    EXPECT_DEATH((SporadicServer{{0ns, 10ns}}), "contract broken");
    EXPECT_DEATH((SporadicServer{{1ns, 10ns}}.consume(at_ns(0), -1ns)), "contract broken");
}

}  // namespace
}  // namespace qduino::sched::sporadic_server_test
