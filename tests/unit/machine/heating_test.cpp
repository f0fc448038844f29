#include "printer/machine/heating.h"

#include <gtest/gtest.h>

#include <memory>

namespace qduino::printer::machine::heating_test {
namespace {

using gcode::Heater;

/// Loop 1's side, and a loop 3 that samples when it is told to.
struct Bench {
    MachineConfig config;
    std::unique_ptr<channel::FourSlot<link::HeatStatus>> published =
        std::make_unique<channel::FourSlot<link::HeatStatus>>();
    Heating heating{config, *published};
    Instant now = instant_from_ns(0);
    double hot_end = 20;
    double bed = 20;
    std::uint64_t pulses = 0;

    explicit Bench(const MachineConfig& with = {}) : config(with) {}
    void sample() {
        static_cast<void>(heating.sample(now, {Celsius{hot_end}, Celsius{bed}, ++pulses}, false));
    }
    void observe() {
        sample();
        heating.observe(now);
    }
};

TEST(Heating, WhatIsAskedReachesLoop3AndItsAnswerIsSeen) {
    Bench bench;
    bench.heating.set_target(Heater::hot_end, Celsius{200});
    bench.heating.set_target(Heater::bed, Celsius{60});
    bench.heating.set_fan(0.5);
    bench.observe();
    EXPECT_EQ(bench.heating.seen().hot_end.target_celsius, 200);
    EXPECT_EQ(bench.heating.seen().bed.target_celsius, 60);
    EXPECT_EQ(bench.published->read().fan_duty, 0.5);
    bench.heating.heaters_off();
    bench.observe();
    EXPECT_EQ(bench.heating.seen().hot_end.target_celsius, 0);
    EXPECT_EQ(bench.heating.seen().fan_duty, 0.5) << "the fan is no heater";
    bench.heating.all_off();
    bench.observe();
    EXPECT_EQ(bench.heating.seen().fan_duty, 0);
}

TEST(Heating, ALoop3ThatFallsSilentIsAFault) {
    Bench bench;
    bench.observe();
    bench.now += 500ms;
    bench.heating.observe(bench.now);
    EXPECT_TRUE(bench.heating.fault().empty());
    bench.now += 1ms;
    bench.heating.observe(bench.now);
    EXPECT_TRUE(bench.heating.silent());
    EXPECT_NE(bench.heating.fault().find("loop 3"), std::string_view::npos);
    EXPECT_NE(bench.heating.persisting_fault().find("restart the sketch"), std::string_view::npos);
    bench.observe();
    EXPECT_FALSE(bench.heating.silent());
}

TEST(Heating, FilamentMovesOnlyWhenTheHotEndIsHot) {
    Bench bench;
    bench.hot_end = 168.9;  // a wait for 170 °C is content from 169 °C on
    bench.observe();
    EXPECT_TRUE(bench.heating.check_cold(0).ok());
    const Result<void> cold = bench.heating.check_cold(-0.1);
    ASSERT_FALSE(cold.ok());
    EXPECT_NE(cold.error().message.view().find("heat it first"), std::string_view::npos);
    for (const double celsius : {168.96, 168.6}) {
        bench.hot_end = celsius;
        bench.observe();
        const std::string said{bench.heating.check_cold(1).error().message.view()};
        EXPECT_NE(said.find(celsius > 168.9 ? "is at 168.9 °C: filament" : "is at 168.6 °C: filament"),
                  std::string::npos)
            << said;
        EXPECT_NE(said.find("from 170 °C on"), std::string::npos) << said;
    }
    bench.hot_end = 169;
    bench.observe();
    EXPECT_TRUE(bench.heating.check_cold(-0.1).ok());
    bench.heating.set_minimum_extrude(Celsius{180});
    EXPECT_FALSE(bench.heating.check_cold(-0.1).ok());
    bench.heating.set_minimum_extrude(Celsius{160});
    bench.hot_end = 159;
    bench.observe();
    EXPECT_TRUE(bench.heating.check_cold(-0.1).ok());
}

TEST(Heating, KeptTargetsAreAskedForAgain) {
    Bench bench;
    bench.heating.set_target(Heater::hot_end, Celsius{200});
    bench.heating.set_target(Heater::bed, Celsius{60});
    bench.heating.keep_targets();
    bench.heating.heaters_off();
    bench.heating.keep_targets();  // a second time keeps nothing new
    bench.heating.ask_for_kept();
    bench.observe();
    EXPECT_EQ(bench.heating.seen().hot_end.target_celsius, 200);
    EXPECT_EQ(bench.heating.seen().bed.target_celsius, 60);
    EXPECT_FALSE(bench.heating.is_warm_again());
    bench.hot_end = 199;
    bench.bed = 59;
    bench.observe();
    EXPECT_TRUE(bench.heating.is_warm_again());
    bench.heating.forget_kept();
    EXPECT_FALSE(bench.heating.keeps_targets());
}

TEST(Heating, WhatIsSetWhileTargetsAreKeptIsTakenOverIfItIsWarmEnough) {
    Bench bench;
    bench.heating.set_target(Heater::hot_end, Celsius{200});
    bench.heating.keep_targets();
    for (const double celsius : {215.0, 0.0, 100.0})
        bench.heating.set_target(Heater::hot_end, Celsius{celsius});
    bench.heating.set_target(Heater::bed, Celsius{50});
    bench.heating.ask_for_kept();
    bench.observe();
    EXPECT_EQ(bench.heating.seen().hot_end.target_celsius, 215)
        << "off is off for now, 100 °C prints nothing";
    EXPECT_EQ(bench.heating.seen().bed.target_celsius, 50);
}

TEST(Heating, FilamentIsDrawnBackOnlyIfItCanBePushedAgain) {
    Bench bench;
    bench.hot_end = 200;
    bench.observe();
    bench.heating.keep_targets();
    EXPECT_FALSE(bench.heating.may_extrude_now_and_later()) << "hot, but it will be off";
    bench.heating.set_target(Heater::hot_end, Celsius{200});
    EXPECT_TRUE(bench.heating.may_extrude_now_and_later());
    bench.hot_end = 100;
    bench.observe();
    EXPECT_FALSE(bench.heating.may_extrude_now_and_later());
}

TEST(Heating, HeatThatNobodyUsesIsLostUntilItIsAskedForAgain) {
    MachineConfig config;
    config.idle_timeout = Seconds{5};
    Bench bench(config);
    bench.hot_end = 200;
    bench.heating.set_target(Heater::hot_end, Celsius{200});
    bench.observe();
    EXPECT_FALSE(bench.heating.idle_lost());
    for (int i = 0; i < 20 && !bench.heating.idle_lost(); ++i) {
        bench.now += 1s;
        --bench.pulses;  // none go out
        bench.observe();
    }
    EXPECT_TRUE(bench.heating.idle_lost());
    bench.heating.set_target(Heater::hot_end, Celsius{200});
    EXPECT_FALSE(bench.heating.idle_lost()) << "loop 3 has not heard of it yet";
    bench.observe();
    EXPECT_FALSE(bench.heating.idle_lost());
}

TEST(Heating, AFaultOfLoop3IsClearedOnRequest) {
    Bench bench;
    bench.observe();
    for (int i = 0; i < 10; ++i) {
        bench.now += 8ms;
        static_cast<void>(bench.heating.sample(bench.now, {std::nullopt, Celsius{20}, 0}, false));
    }
    bench.heating.observe(bench.now);
    EXPECT_NE(bench.heating.fault().find("hot end"), std::string_view::npos);
    for (int i = 0; i < 10; ++i) bench.observe();
    EXPECT_FALSE(bench.heating.fault().empty()) << "it latches";
    bench.heating.clear_faults();
    EXPECT_TRUE(bench.heating.fault().empty());
    bench.observe();
    EXPECT_TRUE(bench.heating.fault().empty());
}

TEST(Heating, AWaitLooksAtTheHeaterThatItIsFor) {
    Bench bench;
    bench.heating.wait().begin(Heater::bed, Celsius{60}, gcode::WaitFor::heating);
    bench.hot_end = 60;
    for (int i = 0; i < 3; ++i, bench.now += 1s) {
        bench.observe();
        bench.heating.advance_wait(bench.now);
    }
    EXPECT_TRUE(bench.heating.wait().active());
    bench.bed = 60;
    for (int i = 0; i < 3; ++i, bench.now += 1s) {
        bench.observe();
        bench.heating.advance_wait(bench.now);
    }
    EXPECT_FALSE(bench.heating.wait().active());
}

}  // namespace
}  // namespace qduino::printer::machine::heating_test
