#include "sched/refill_queue.h"

#include <gmock/gmock.h>

#include "base/contract.h"
#include "tests/unit/sched/make.h"

namespace qduino::sched::refill_queue_test {
namespace {

using ::testing::ElementsAre;

constexpr Refill refill(std::int64_t time_ns, std::int64_t amount_ns) {
    return {instant_from_ns(time_ns), Nanoseconds{amount_ns}};
}

TEST(RefillQueue, SpendingAPartSplitsTheHead) {
    RefillQueue queue{at_ns(0), 5ns};
    queue.spend(2ns, 20ns);
    EXPECT_THAT(queue.refills(), ElementsAre(refill(2, 3), refill(20, 2)));
    EXPECT_EQ(queue.total(), 5ns);
}

TEST(RefillQueue, SpendingAllMovesItByOnePeriod) {
    RefillQueue queue{at_ns(7), 5ns};
    queue.spend(5ns, 20ns);
    EXPECT_THAT(queue.refills(), ElementsAre(refill(27, 5)));
}

TEST(RefillQueue, ConsecutivePiecesComeBackAsOne) {
    RefillQueue queue{at_ns(0), 5ns};
    queue.spend(2ns, 20ns);
    queue.spend(2ns, 20ns);
    EXPECT_THAT(queue.refills(), ElementsAre(refill(4, 1), refill(20, 4)));
}

TEST(RefillQueue, MoreThanIsDueTakesFromTheNextAndSplitsIt) {
    RefillQueue queue{at_ns(0), 5ns};
    queue.spend(2ns, 20ns);  // {2,3} {20,2}
    queue.spend(4ns, 20ns);  // 3 of the first; 1 that was due at 20 comes at 40
    EXPECT_THAT(queue.refills(), ElementsAre(refill(21, 4), refill(40, 1)));
}

TEST(RefillQueue, AdvancingMergesWhatHasBecomeDue) {
    RefillQueue queue{at_ns(0), 5ns};
    queue.spend(2ns, 20ns);  // {2,3} {20,2}
    queue.advance(at_ns(18));
    EXPECT_THAT(queue.refills(), ElementsAre(refill(18, 5)));
}

TEST(RefillQueue, AdvancingMergesOnlyWhatTouches) {
    RefillQueue queue{at_ns(0), 5ns};
    queue.spend(2ns, 20ns);  // {2,3} {20,2}
    queue.advance(at_ns(16));
    EXPECT_THAT(queue.refills(), ElementsAre(refill(16, 3), refill(20, 2)));
    queue.advance(at_ns(10));  // never back
    EXPECT_THAT(queue.refills(), ElementsAre(refill(16, 3), refill(20, 2)));
}

TEST(RefillQueue, FullListDelaysTheLastUntilTheNewOneTouches) {
    RefillQueue queue{at_ns(0), 9ns, 2};
    queue.spend(2ns, 100ns);  // {2,7} {100,2}
    queue.advance(at_ns(10));
    queue.spend(3ns, 100ns);  // a third, {110,3}, has no place
    EXPECT_THAT(queue.refills(), ElementsAre(refill(13, 4), refill(108, 5)));
}

TEST(RefillQueue, ListOfOneDelaysTheRest) {
    RefillQueue queue{at_ns(0), 9ns, 1};
    queue.spend(2ns, 100ns);
    EXPECT_THAT(queue.refills(), ElementsAre(refill(93, 9)));
}

TEST(RefillQueue, WholeRoundsMoveEverything) {
    RefillQueue queue{at_ns(0), 5ns};
    queue.spend(2ns, 20ns);  // {2,3} {20,2}
    queue.spend(1000 * 5ns, 20ns);
    EXPECT_THAT(queue.refills(), ElementsAre(refill(20'002, 3), refill(20'020, 2)));
}

TEST(RefillQueue, WholeCoreNeverPauses) {
    RefillQueue queue{at_ns(0), 10ns};
    for (int i = 1; i <= 100; ++i) {
        queue.spend(1ns, 10ns);
        EXPECT_THAT(queue.refills(), ElementsAre(refill(i, 10)));
    }
}

TEST(RefillQueue, SplintersAreHeldBackUntilTheyJoin) {
    RefillQueue queue{at_ns(0), 9ns};
    queue.spend(8ns, 100ns);  // {8,1} {100,8}
    queue.join_splinters(2ns);
    EXPECT_THAT(queue.refills(), ElementsAre(refill(99, 9)));
}

TEST(RefillQueue, AGapIsClosedByDelay) {
    RefillQueue queue{at_ns(0), 9ns};
    queue.spend(2ns, 100ns);   // {2,7} {100,2}
    queue.advance(at_ns(92));  // {92,7} {100,2}: 1 between them
    queue.close_gaps(1ns);
    EXPECT_THAT(queue.refills(), ElementsAre(refill(92, 7), refill(100, 2)));
    queue.close_gaps(2ns);
    EXPECT_THAT(queue.refills(), ElementsAre(refill(93, 9)));
}

TEST(RefillQueue, ContiguousTimeCountsWhatFallsDueMeanwhile) {
    RefillQueue queue{at_ns(0), 9ns};
    queue.spend(4ns, 20ns);  // {4,5} {20,4}
    EXPECT_EQ(queue.contiguous_from(at_ns(3)), 0ns);
    EXPECT_EQ(queue.contiguous_from(at_ns(4)), 5ns);
    EXPECT_EQ(queue.contiguous_from(at_ns(14)), 5ns);
    EXPECT_EQ(queue.contiguous_from(at_ns(15)), 9ns);
}

TEST(RefillQueueDeathTest, ContractsHold) {
    EXPECT_DEATH(RefillQueue(at_ns(0), 0ns), "contract broken");
    EXPECT_DEATH(RefillQueue(at_ns(0), 1ns, 0), "contract broken");
    EXPECT_DEATH(RefillQueue(at_ns(0), 1ns, RefillQueue::kCapacity + 1), "contract broken");
    EXPECT_DEATH(RefillQueue(at_ns(0), 1ns).spend(-1ns, 10ns), "contract broken");
}

}  // namespace
}  // namespace qduino::sched::refill_queue_test
