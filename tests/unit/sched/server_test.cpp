// The sum of the two servers: each question goes to the right one, and inheritance reaches PIBS
// through it.
#include "sched/server.h"

#include <gtest/gtest.h>

#include "tests/unit/sched/make.h"

namespace qduino::sched::server_test {
namespace {

TEST(Server, AMainVcpuRanksByItsOwnPeriodAndWakesInIt) {
    Server server{SporadicServer{{3ns, 10ns}}};
    EXPECT_FALSE(server.is_io());
    EXPECT_FALSE(server.has_work());
    server.wake(at_ns(5));
    EXPECT_TRUE(server.has_work());
    EXPECT_EQ(server.rank_period(), 10ns);
    EXPECT_EQ(server.available(at_ns(5)), 3ns);
    EXPECT_EQ(server.consume(at_ns(8), 3ns), 0ns);
    EXPECT_EQ(server.next_replenishment(), at_ns(15));
    EXPECT_EQ(server.consume(at_ns(10), 2ns), 2ns) << "the whole of it is overrun";
    EXPECT_EQ(server.consumed(), 5ns);
    EXPECT_EQ(server.refills().size(), 2u);
    server.block(at_ns(8));
    EXPECT_FALSE(server.has_work());
}

TEST(Server, AnIoVcpuWokenForNobodyServesItsOwnPeriod) {
    Server server{Pibs{{1ns, 4ns}}};
    EXPECT_TRUE(server.is_io());
    EXPECT_FALSE(server.has_work());
    server.wake(at_ns(0));
    EXPECT_EQ(server.rank_period(), 4ns);
    EXPECT_EQ(server.available(at_ns(0)), 1ns);
    EXPECT_TRUE(server.refills().empty());
    server.block(at_ns(0));
    EXPECT_FALSE(server.has_work());
    EXPECT_EQ(server.available(at_ns(0)), 0ns);
}

TEST(Server, AnIoVcpuInheritsThePeriodOfItsClientAndIsRaisedByAShorterOne) {
    Server server{Pibs{{1ns, 4ns}}};
    server.wake_for(at_ns(0), 400ns);
    EXPECT_EQ(server.rank_period(), 400ns);
    EXPECT_EQ(server.available(at_ns(0)), 100ns);
    server.consume(at_ns(10), 10ns);
    server.wake_for(at_ns(10), 40ns);
    EXPECT_EQ(server.rank_period(), 40ns);
    EXPECT_EQ(server.available(at_ns(10)), 10ns);  // clamped to U·40
    server.wake_for(at_ns(11), 400ns);
    EXPECT_EQ(server.rank_period(), 40ns);
    server.consume(at_ns(20), 10ns);
    EXPECT_EQ(server.next_replenishment(), at_ns(80));
}

TEST(ServerDeathTest, OnlyAnIoVcpuWorksForAClient) {
    EXPECT_DEATH((Server{SporadicServer{{3ns, 10ns}}}.wake_for(at_ns(0), 20ns)), "contract broken");
}

}  // namespace
}  // namespace qduino::sched::server_test
