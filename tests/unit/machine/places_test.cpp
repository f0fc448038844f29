#include "printer/machine/places.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

namespace qduino::printer::machine::places_test {
namespace {

struct Bench {
    std::unique_ptr<Places> places = std::make_unique<Places>();
    std::vector<double> performed;
    std::uint32_t append(double duty) { return places->append({FanDuty{duty}}); }
    void pass(std::uint32_t number) {
        places->pass(number, [this](const Place& place) {
            performed.push_back(std::get<FanDuty>(place.action).duty);
        });
    }
};

TEST(Places, ActionsHappenInOrderAndOnce) {
    Bench bench;
    for (int i = 1; i <= 5; ++i) EXPECT_EQ(bench.append(i), static_cast<std::uint32_t>(i));
    bench.pass(3);
    EXPECT_EQ(bench.performed, (std::vector<double>{1, 2, 3}));
    bench.pass(3);
    bench.pass(5);
    EXPECT_EQ(bench.performed, (std::vector<double>{1, 2, 3, 4, 5}));
    EXPECT_TRUE(bench.places->all_passed());
}

TEST(Places, ANumberThatWasNeverGivenDoesNothing) {
    Bench bench;
    bench.append(1);
    bench.pass(2);
    bench.pass(0xFFFFFFFF);
    EXPECT_TRUE(bench.performed.empty());
    bench.pass(1);
    EXPECT_EQ(bench.performed.size(), 1u);
}

TEST(Places, WhatIsForgottenNeverHappens) {
    Bench bench;
    bench.append(1);
    const std::uint32_t forgotten = bench.append(2);
    bench.places->forget();
    EXPECT_TRUE(bench.places->all_passed());
    bench.pass(forgotten);
    EXPECT_TRUE(bench.performed.empty());
    bench.pass(bench.append(3));
    EXPECT_EQ(bench.performed, (std::vector<double>{3}));
}

TEST(Places, AreFullAtTheirCapacityAndGoRoundManyTimes) {
    Bench bench;
    std::uint32_t last = 0;
    for (int round = 0; round < 3; ++round) {
        while (!bench.places->full()) last = bench.append(round);
        bench.pass(last);
    }
    EXPECT_EQ(last, 3u * Places::kCapacity);
    EXPECT_EQ(bench.performed.size(), 3u * Places::kCapacity);
    EXPECT_EQ(bench.performed.back(), 2);
}

TEST(Places, SayThatMotorsGoOffUntilTheLastSuchPlaceIsPassedOrForgotten) {
    const auto places = std::make_unique<Places>();
    const auto off = [&] { return places->append({MotorsOff{gcode::AxisSet::all()}}); };
    const auto pass = [&](std::uint32_t number) { places->pass(number, [](const Place&) {}); };
    pass(places->append({FanDuty{1}}));
    EXPECT_FALSE(places->motors_go_off());
    const std::uint32_t first = off();
    const std::uint32_t second = off();
    const std::uint32_t behind = places->append({FanDuty{0}});
    pass(first);
    EXPECT_TRUE(places->motors_go_off());
    pass(second);
    EXPECT_FALSE(places->motors_go_off());
    pass(behind);
    static_cast<void>(off());
    places->forget();
    EXPECT_FALSE(places->motors_go_off());
}

TEST(Places, EachActionKeepsItsOwnKindOfValue) {
    auto places = std::make_unique<Places>();
    static_cast<void>(places->append({HeaterTarget{gcode::Heater::bed, Celsius{60}}, {10, 2, 1}}));
    const std::uint32_t last =
        places->append({MotorsOff{gcode::AxisSet{}.add(Axis::x).add(Axis::e)}, {20, 3, 1}});
    std::vector<Place> passed;
    places->pass(last, [&](const Place& place) { passed.push_back(place); });
    ASSERT_EQ(passed.size(), 2u);
    EXPECT_EQ(std::get<HeaterTarget>(passed[0].action).heater, gcode::Heater::bed);
    EXPECT_EQ(std::get<HeaterTarget>(passed[0].action).target, Celsius{60});
    EXPECT_EQ(passed[0].progress.line, 2u);
    EXPECT_TRUE(std::get<MotorsOff>(passed[1].action).axes.contains(Axis::e));
    EXPECT_FALSE(std::get<MotorsOff>(passed[1].action).axes.contains(Axis::y));
}

}  // namespace
}  // namespace qduino::printer::machine::places_test
