#include "printer/machine/place_queue.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

namespace qduino::printer::machine {
namespace {

PlaceAction fan(double duty) {
    PlaceAction action;
    action.kind = PlaceAction::Kind::fan;
    action.value = duty;
    return action;
}

struct Bench {
    std::unique_ptr<PlaceQueue> queue = std::make_unique<PlaceQueue>();
    std::vector<double> performed;
    void pass(std::uint32_t number) {
        queue->pass(number, [this](const PlaceAction& action) { performed.push_back(action.value); });
    }
};

TEST(PlaceQueue, ActionsHappenInOrderAndOnce) {
    Bench bench;
    for (int i = 1; i <= 5; ++i) bench.queue->append(fan(i));
    bench.pass(3);
    EXPECT_EQ(bench.performed, (std::vector<double>{1, 2, 3}));
    bench.pass(3);
    bench.pass(5);
    EXPECT_EQ(bench.performed, (std::vector<double>{1, 2, 3, 4, 5}));
    EXPECT_TRUE(bench.queue->all_passed());
}

TEST(PlaceQueue, ANumberThatWasNeverGivenDoesNothing) {
    Bench bench;
    bench.queue->append(fan(1));
    bench.pass(2);
    bench.pass(0xFFFFFFFF);
    EXPECT_TRUE(bench.performed.empty());
    bench.pass(1);
    EXPECT_EQ(bench.performed.size(), 1u);
}

TEST(PlaceQueue, WhatIsForgottenNeverHappens) {
    Bench bench;
    bench.queue->append(fan(1));
    bench.queue->append(fan(2));
    bench.queue->forget();
    EXPECT_TRUE(bench.queue->all_passed());
    bench.pass(2);
    EXPECT_TRUE(bench.performed.empty());
    const std::uint32_t next = bench.queue->next_number();
    bench.queue->append(fan(3));
    bench.pass(next);
    EXPECT_EQ(bench.performed, (std::vector<double>{3}));
}

TEST(PlaceQueue, IsFullAtItsCapacityAndGoesRoundManyTimes) {
    Bench bench;
    for (int round = 0; round < 3; ++round) {
        while (!bench.queue->full()) bench.queue->append(fan(round));
        bench.pass(bench.queue->next_number() - 1);
    }
    EXPECT_EQ(bench.performed.size(), 3u * PlaceQueue::kCapacity);
    EXPECT_EQ(bench.performed.back(), 2);
}

}  // namespace
}  // namespace qduino::printer::machine
