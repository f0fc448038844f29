#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/unit/twin/pin_player.h"
#include "twin/heater.h"
#include "twin/printer.h"

namespace qduino::twin::heat_test {
namespace {

using testing::PinPlayer;

constexpr Instant at_s(double seconds) { return kEpoch + from_seconds(seconds); }

TEST(TwinHeater, ClosedFormAgreesWithSmallSteps) {
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
        std::mt19937_64 random(seed);
        std::uniform_real_distribution<double> unit(0, 1);
        HeaterSpec spec;
        spec.heat_capacity_j_k = 5 + 40 * unit(random);
        spec.loss_w_k = 0.05 + 0.3 * unit(random);
        spec.sensor_lag_s = 0.5 + 5 * unit(random);
        Heater heater(spec, 20);
        double block = 20, sensor = 20, now = 0;
        for (int segment = 0; segment < 30; ++segment) {
            const double duty = unit(random), fan = unit(random), length = 10 * unit(random);
            heater.set_duty(at_s(now), duty);
            heater.set_fan(at_s(now), fan);
            const double loss = spec.loss_w_k * (1 + spec.fan_loss_share * fan);
            constexpr int kSteps = 20'000;
            for (int i = 0; i < kSteps; ++i) {
                const double dt = length / kSteps;
                sensor += (block - sensor) / spec.sensor_lag_s * dt;
                block += (spec.power_w * duty - loss * (block - 20)) / spec.heat_capacity_j_k * dt;
            }
            now += length;
            heater.advance(at_s(now));
            ASSERT_NEAR(heater.block_celsius(), block, 0.02) << "seed " << seed;
            ASSERT_NEAR(heater.sensor_celsius(), sensor, 0.02) << "seed " << seed;
        }
    }
}

TEST(TwinHeater, AdvancingInPartsIsAdvancingAtOnce) {
    Heater whole(HeaterSpec{}, 20), parts(HeaterSpec{}, 20);
    whole.set_duty(kEpoch, 0.7);
    parts.set_duty(kEpoch, 0.7);
    for (int i = 1; i <= 10'000; ++i) parts.advance(at_s(i * 0.01));
    whole.advance(at_s(100));
    EXPECT_NEAR(whole.block_celsius(), parts.block_celsius(), 1e-6);
    EXPECT_NEAR(whole.sensor_celsius(), parts.sensor_celsius(), 1e-6);
}

TEST(TwinHeater, EqualTimeConstantsAreNoSpecialCase) {
    HeaterSpec spec;
    spec.sensor_lag_s = spec.heat_capacity_j_k / spec.loss_w_k;
    Heater heater(spec, 20);
    heater.set_duty(kEpoch, 1);
    heater.advance(at_s(spec.sensor_lag_s));
    const double rise = spec.power_w / spec.loss_w_k;
    EXPECT_NEAR(heater.sensor_celsius(), 20 + rise * (1 - 2 * std::exp(-1.0)), 0.1);
}

TEST(TwinHeat, FullPowerHeatsTheHotEndInTwoToThreeMinutes) {
    Printer printer{Machine{}};
    PinPlayer player(printer);
    player.heat(kHotEnd, 1.0);
    int seconds = 0;
    while (printer.sensor_celsius(player.now, kHotEnd) < 210 && seconds < 1000) {
        player.wait(1s);
        ++seconds;
    }
    EXPECT_GE(seconds, 110);
    EXPECT_LE(seconds, 180);
    player.heat(kHotEnd, 0.0);
    player.wait(3600s);
    EXPECT_NEAR(printer.sensor_celsius(player.now, kHotEnd), 20, 0.1);
}

TEST(TwinHeat, TheBedReachesSixtyInMinutes) {
    Printer printer{Machine{}};
    PinPlayer player(printer);
    player.heat(kBed, 1.0);
    player.wait(120s);
    EXPECT_LT(printer.sensor_celsius(player.now, kBed), 60);
    player.wait(180s);
    EXPECT_GT(printer.sensor_celsius(player.now, kBed), 60);
}

TEST(TwinHeat, TheConverterTellsTheTemperatureOfEachHeater) {
    Printer printer{Machine{}};
    PinPlayer player(printer);
    player.heat(kHotEnd, 1.0);
    player.heat(kBed, 0.5);
    for (int i = 0; i < 150; ++i) {
        player.wait(1s);
        for (const int heater : {kHotEnd, kBed}) {
            const Result<Celsius> read = player.temperature(heater);
            ASSERT_TRUE(read.ok());
            ASSERT_NEAR(read->value(), printer.sensor_celsius(player.now, heater), 0.35);
        }
    }
    EXPECT_EQ(printer.state(player.now).conversions, 300u);
}

TEST(TwinHeat, AnotherAddressAnswersNothing) {
    Printer printer{Machine{}};
    std::array<std::uint8_t, 2> answer{};
    const Result<void> done =
        printer.i2c_transfer(kEpoch, board::I2cBus{0}, board::I2cAddress{0x49}, {}, answer);
    ASSERT_FALSE(done.ok());
    EXPECT_EQ(done.error().code, ErrorCode::timed_out);
}

TEST(TwinHeat, AStepPinIsNoHeaterAndAHeaterPinWrittenHighIsFullPower) {
    Printer printer{Machine{}};
    printer.pin_written(kEpoch, board::PinId{17}, board::Level::high);
    EXPECT_DOUBLE_EQ(printer.state(kEpoch).heater_duty[kHotEnd], 1.0);
    printer.pwm_written(kEpoch, board::PinId{2}, 1.0);
    printer.pin_written(kEpoch, board::PinId{17}, board::Level::low);
    EXPECT_DOUBLE_EQ(printer.state(kEpoch).heater_duty[kHotEnd], 0.0);
    EXPECT_DOUBLE_EQ(printer.state(kEpoch).heater_duty[kBed], 0.0);
}

// The paper's PID figures (Marlin's units: output 0…255) on the twin through its converter, at 8
// ms.
struct Pid {
    double kp, ki, kd, output_integral = 0, last = 20, slope = 0;
    double duty(double target, double celsius, double dt) {
        const double error = target - celsius;
        if (std::abs(error) > 10) {
            output_integral = 0;
            last = celsius;
            return error > 0 ? 1.0 : 0.0;
        }
        output_integral = std::clamp(output_integral + ki * error * dt, 0.0, 255.0);
        slope += (dt / (dt + 1.0)) * ((celsius - last) / dt - slope);
        last = celsius;
        return std::clamp(kp * error + output_integral - kd * slope, 0.0, 255.0) / 255;
    }
};

TEST(TwinHeat, ThePapersPidHoldsTheHotEnd) {
    Printer printer{Machine{}};
    PinPlayer player(printer);
    Pid pid{22.2, 1.08, 114};
    double highest = 0;
    for (int tick = 0; tick < 600 * 125; ++tick) {
        player.wait(8ms);
        // The part fan comes on.
        if (tick == 400 * 125) printer.pwm_written(player.now, board::PinId{19}, 1.0);
        player.heat(kHotEnd, pid.duty(210, player.temperature(0)->value(), 0.008));
        const double celsius = printer.sensor_celsius(player.now, kHotEnd);
        highest = std::max(highest, celsius);
        const double allowed = tick > 500 * 125 ? 1.0 : tick > 280 * 125 ? 3.0 : 200.0;
        ASSERT_NEAR(celsius, 210, allowed) << tick * 0.008;
    }
    EXPECT_LT(highest, 216);
}

TEST(TwinHeat, MoltenPlasticTakesHeatAway) {
    Machine machine;
    Printer idle{machine}, busy{machine};
    PinPlayer idle_player(idle), busy_player(busy);
    for (PinPlayer* player : {&idle_player, &busy_player}) {
        player->heat(kHotEnd, 0.4);
        player->wait(600s);
    }
    busy_player.steps(kExtruder, 1, 20 * 96, Nanoseconds{2'000'000});
    idle_player.now = busy_player.now;
    EXPECT_LT(busy.sensor_celsius(busy_player.now, kHotEnd),
              idle.sensor_celsius(idle_player.now, kHotEnd) - 0.3);
}

// ---- faults -------------------------------------------------------------------------------------

TEST(TwinFault, ASensorSticksAtItsInstant) {
    Printer printer{Machine{}};
    printer.inject(*parse_fault("sensor_stuck:hot_end@60"));
    PinPlayer player(printer);
    player.heat(kHotEnd, 1.0);
    player.wait(60s);
    const double then = player.temperature(0)->value();
    player.wait(60s);
    EXPECT_NEAR(player.temperature(0)->value(), then, 1e-9);
    EXPECT_GT(printer.sensor_celsius(player.now, kHotEnd), then + 40) << "the block heats on";
    printer.clear_faults(player.now);
    EXPECT_GT(player.temperature(0)->value(), then + 40);
}

TEST(TwinFault, AFaultCountsFromItsInstantThoughNobodyLooked) {
    Printer looked_at{Machine{}}, left_alone{Machine{}};
    for (Printer* printer : {&looked_at, &left_alone}) {
        printer->inject(*parse_fault("sensor_stuck:hot_end@60"));
        PinPlayer player(*printer);
        player.heat(kHotEnd, 1.0);
        if (printer == &looked_at) {
            player.wait(60s);
            ASSERT_TRUE(player.temperature(0).ok());
            player.wait(60s);
        } else {
            player.wait(120s);
        }
        EXPECT_NEAR(player.temperature(0)->value(), 118, 10);
    }
}

TEST(TwinFault, OpenAndShortedSensors) {
    Printer printer{Machine{}};
    PinPlayer player(printer);
    printer.inject(*parse_fault("sensor_open:bed"));
    EXPECT_THAT(std::string(player.temperature(1).error().message.view()), ::testing::HasSubstr("open"));
    EXPECT_TRUE(player.temperature(0).ok());
    printer.inject(*parse_fault("sensor_short:bed"));
    EXPECT_THAT(std::string(player.temperature(1).error().message.view()), ::testing::HasSubstr("short"));
}

TEST(TwinFault, HeatersThatDoNotObey) {
    Printer printer{Machine{}};
    PinPlayer player(printer);
    printer.inject(*parse_fault("heater_disconnected:hot_end@30"));
    printer.inject(*parse_fault("heater_stuck_on:bed@30"));
    player.heat(kHotEnd, 1.0);
    player.wait(30s);
    const double peak = printer.sensor_celsius(player.now, kHotEnd);
    player.wait(200s);
    EXPECT_LT(printer.sensor_celsius(player.now, kHotEnd), peak + 5);
    EXPECT_GT(printer.sensor_celsius(player.now, kBed), 40);
    EXPECT_DOUBLE_EQ(printer.state(player.now).heater_duty[kBed], 0.0)
        << "what the board drives is not to blame";
}

TEST(TwinFault, ASilentBusStuckSwitchesAndACutMotor) {
    Printer printer{Machine{}};
    PinPlayer player(printer);
    for (const char* fault : {"bus_silent@1", "endstop_stuck_closed:x@1", "motor_disconnected:y@1"})
        printer.inject(*parse_fault(fault));
    EXPECT_GE(player.convert(0), 0);
    EXPECT_FALSE(player.pressed(0));
    player.wait(1s);
    EXPECT_EQ(player.convert(0), -1);
    EXPECT_TRUE(player.pressed(0));
    const std::int64_t start = printer.axis(1).position();
    player.steps(1, 1, 50, Nanoseconds{500'000});
    EXPECT_EQ(printer.axis(1).position(), start);
    EXPECT_EQ(printer.state(player.now).counters[1].lost(), 50u);
    printer.clear_faults(player.now);
    printer.inject(*parse_fault("endstop_stuck_open:z"));
    player.steps(2, -1, 12 * 2020 + 10, Nanoseconds{300'000});
    EXPECT_TRUE(printer.state(player.now).pressed[2]);
    EXPECT_FALSE(player.pressed(2));
}

TEST(TwinFault, TextsAreReadAndRefusedWithAReason) {
    const auto fault = parse_fault("heater_stuck_on:bed@12.5");
    ASSERT_TRUE(fault.ok());
    EXPECT_EQ(fault->kind, FaultKind::heater_stuck_on);
    EXPECT_EQ(fault->which, kBed);
    EXPECT_EQ(fault->at, at_s(12.5));
    EXPECT_EQ(parse_fault("sensor_open")->which, kHotEnd);
    EXPECT_EQ(parse_fault("motor_disconnected:e")->which, 3);
    for (const char* text :
         {"", "sensor", "sensor_open:x", "endstop_stuck_open", "endstop_stuck_open:e", "bus_silent:x",
          "bus_silent@", "bus_silent@-1", "bus_silent@1e99", "bus_silent@5s", "@5"}) {
        const auto bad = parse_fault(text);
        ASSERT_FALSE(bad.ok()) << text;
        EXPECT_EQ(bad.error().code, ErrorCode::invalid_argument) << text;
    }
    for (int kind = 0; kind <= static_cast<int>(FaultKind::motor_disconnected); ++kind)
        EXPECT_NE(name_of(static_cast<FaultKind>(kind)), "unknown");
}

}  // namespace
}  // namespace qduino::twin::heat_test
