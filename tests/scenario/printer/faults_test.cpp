// Each fault that is not of the heat, and how long the machine takes until it is safe: nothing
// moves, and nothing is hot that nobody watches. One row of the table in docs/faults.md each; the
// times are virtual, and printed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bitset>

#include "printer/preflight/preflight.h"
#include "tests/scenario/printer/printer_bench.h"

namespace qduino::tests::faults_test {
namespace {

using link::JobOutcome;
using link::MachineState;

/// Sees when the machine was last stepped, and can hang a loop: it sleeps in its own write.
class FaultyPins final : public board::ForwardingPeripherals {
  public:
    enum class Hangs { none, loop_1, loop_2, loop_3 };

    explicit FaultyPins(const printer::MachineConfig& config) {
        for (const auto& axis : config.axes) {
            steps_.set(axis.step_pin);
            enables_.set(axis.enable_pin);
        }
    }
    void pin_written(Instant now, board::PinId pin, board::Level level) override {
        if (steps_.test(pin.number) && level == board::Level::high) last_step = now;
        ForwardingPeripherals::pin_written(now, pin, level);
        if (enables_.test(pin.number)) hang(Hangs::loop_1, now);
        if (steps_.test(pin.number)) hang(Hangs::loop_2, now);
    }
    Result<void> i2c_transfer(Instant now, board::I2cBus bus, board::I2cAddress address,
                              std::span<const std::uint8_t> out, std::span<std::uint8_t> in) override {
        hang(Hangs::loop_3, now);
        return ForwardingPeripherals::i2c_transfer(now, bus, address, out, in);
    }

    Hangs wanted = Hangs::none;
    Instant last_step{};
    std::optional<Instant> hung_at;

  private:
    void hang(Hangs here, Instant now) {
        if (wanted != here) return;
        wanted = Hangs::none;
        hung_at = now;
        board::current().sleep_until(now + std::chrono::hours{1000});
    }
    std::bitset<board::kPinCount> steps_, enables_;
};

class Faults : public testing::Test {
  protected:
    Faults() { pins.forward_to(bench.twin()); }

    [[nodiscard]] bool is_cold() {
        const auto metal = bench.metal();
        return metal.heater_duty[twin::kHotEnd] == 0 && metal.heater_duty[twin::kBed] == 0;
    }
    /// Seconds from `from` until both heaters are off.
    double until_cold(Instant from, double limit_s) {
        EXPECT_TRUE(bench.run_until([&] { return is_cold(); }, limit_s));
        return to_seconds(bench.now() - from);
    }
    void say(const char* fault, double motion_s, double heat_s) {
        std::printf("  %-44s motion stops after %7.3f s, heat after %7.3f s\n", fault, motion_s, heat_s);
    }
    /// Hot, homed, and in a long move.
    void print_on() {
        ASSERT_TRUE(bench.begin(&pins));
        std::string job = "G28\nM104 S200\nM190 S60\nM109 S200\n";
        for (int i = 0; i < 400; ++i) job += i % 2 == 0 ? "G1 X90 E1 F1200\nG92 E0\n" : "G1 X10 E1\nG92 E0\n";
        bench.job(job);
        ASSERT_TRUE(bench.run_until([&] { return bench.status().line > 12; }, 1500)) << bench.fault();
        ASSERT_FALSE(is_cold());
    }

    FaultyPins pins{printer::MachineConfig{}};  // outlives the bench
    PrinterBench bench;
};

struct Row {
    const char* name;
    const char* fault;
    const char* words;
};
class Homing : public Faults, public testing::WithParamInterface<Row> {};

/// Heat is on while it homes, as slicers write it.
TEST_P(Homing, NoticesWhatIsBrokenAndStops) {
    bench.twin().inject(*twin::parse_fault(GetParam().fault));
    ASSERT_TRUE(bench.begin(&pins));
    const Instant began = bench.now();
    bench.job("M104 S200\nM140 S60\nG28\nG1 X50 F3000\n");
    ASSERT_TRUE(bench.run_until([&] { return bench.status().state == MachineState::faulted; }, 300));
    EXPECT_NE(bench.fault().find(GetParam().words), std::string::npos) << bench.fault();
    const double heat_s = until_cold(began, 1);
    bench.run(5);
    say(GetParam().name, to_seconds(pins.last_step - began), heat_s);
    EXPECT_LT(pins.last_step, began + from_seconds(heat_s) + 200ms);
    EXPECT_EQ(bench.status().outcome, JobOutcome::failed);
}
INSTANTIATE_TEST_SUITE_P(Of, Homing,
                         testing::Values(Row{"endstop_dead", "endstop_stuck_open:y", "Y endstop"},
                                         Row{"endstop_stuck", "endstop_stuck_closed:x", "X endstop"},
                                         Row{"motor_unplugged", "motor_disconnected:x", "X endstop"}),
                         [](const auto& each) { return each.param.name; });

struct HeatRow {
    const char* name;
    const char* fault;
    double within_s;           ///< motion and heat
    double never_above = 206;  ///< °C, of the block, until heat is off
};
class HeatInMidPrint : public Faults, public testing::WithParamInterface<HeatRow> {};

/// heat_faults_test.cpp breaks the same at rest, and asks how hot the block becomes.
TEST_P(HeatInMidPrint, StopsMotionAndHeat) {
    print_on();
    const Instant broken = bench.now();
    twin::Fault fault = *twin::parse_fault(GetParam().fault);
    fault.at = broken;
    bench.twin().inject(fault);
    ASSERT_TRUE(bench.run_until([&] { return !bench.heat().fault.empty(); }, GetParam().within_s));
    const double heat_s = until_cold(broken, 1);
    EXPECT_LE(bench.metal().block_celsius[twin::kHotEnd], GetParam().never_above);
    bench.run(3);
    const double motion_s = to_seconds(pins.last_step - broken);
    say(GetParam().name, motion_s, heat_s);
    EXPECT_EQ(bench.status().state, MachineState::faulted);
    EXPECT_EQ(bench.status().outcome, JobOutcome::failed);
    EXPECT_LE(heat_s, GetParam().within_s);
    EXPECT_LE(motion_s, GetParam().within_s);
    EXPECT_NE(bench.fault().find("heat is off; "), std::string::npos) << bench.fault();
}
INSTANTIATE_TEST_SUITE_P(Of, HeatInMidPrint,
                         testing::Values(HeatRow{"thermistor_open", "sensor_open:hot_end", 0.3},
                                         HeatRow{"thermistor_short", "sensor_short:hot_end", 0.3},
                                         HeatRow{"thermistor_frozen_at_target", "sensor_stuck:hot_end", 400,
                                                 220},
                                         HeatRow{"thermistor_drifts", "sensor_drifts:hot_end", 90, 230},
                                         HeatRow{"bed_thermistor_open", "sensor_open:bed", 0.3},
                                         HeatRow{"bus_silent", "bus_silent", 0.3},
                                         HeatRow{"heater_dead", "heater_disconnected:hot_end", 40},
                                         HeatRow{"heater_stuck_on", "heater_stuck_on:hot_end", 45, 255}),
                         [](const auto& each) { return each.param.name; });

/// No open-loop machine sees it; the twin does, and so does the next homing.
TEST_F(Faults, AMotorUnpluggedInMidPrintIsAWrongPart) {
    print_on();
    bench.twin().inject(*twin::parse_fault("motor_disconnected:y"));
    bench.twin().inject(*twin::parse_fault("motor_disconnected:x"));
    ASSERT_TRUE(bench.finish_job());
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed);
    EXPECT_FALSE(bench.report().matches);
    bench.type("G28");
    ASSERT_TRUE(bench.run_until([&] { return bench.status().state == MachineState::faulted; }, 300));
    EXPECT_NE(bench.fault().find("X endstop"), std::string::npos) << bench.fault();
}

/// Without a supervisor, which would end the sketch after 2 s, 1 s and 1 s (tests/scenario/
/// supervisor measures that in real time): what the other loops do by themselves.
TEST_F(Faults, Loop1Hangs) {
    ASSERT_TRUE(bench.begin(&pins));
    for (const char* line : {"M104 S200", "G28", "M190 S60", "G1 X90 F600"}) bench.type(line);
    ASSERT_TRUE(
        bench.run_until([&] { return bench.metal().position_mm[0] > 5 && bench.status().homed[2]; }, 1500));
    pins.wanted = FaultyPins::Hangs::loop_1;
    bench.type("M84");  // loop 1 writes the enable pins
    ASSERT_TRUE(bench.run_until([&] { return pins.hung_at.has_value(); }, 60));
    bench.run(5);
    const double motion_s = to_seconds(std::max(pins.last_step, *pins.hung_at) - *pins.hung_at);
    const double heat_s = until_cold(*pins.hung_at, 900);
    say("loop 1 hangs: idle watch of loop 3", motion_s, heat_s);
    EXPECT_LE(motion_s, 2.1) << "what lay in the ring";
    EXPECT_LE(heat_s, 603) << "idle_timeout_s behind the last step";
}

TEST_F(Faults, Loop2Hangs) {
    print_on();
    pins.wanted = FaultyPins::Hangs::loop_2;
    ASSERT_TRUE(bench.run_until([&] { return pins.hung_at.has_value(); }, 10));
    bench.run(5);
    const double heat_s = until_cold(*pins.hung_at, 900);
    say("loop 2 hangs: idle watch of loop 3", to_seconds(pins.last_step - *pins.hung_at), heat_s);
    EXPECT_LE(pins.last_step, *pins.hung_at);
    EXPECT_LE(heat_s, 601);
}

TEST_F(Faults, Loop3Hangs) {
    print_on();
    pins.wanted = FaultyPins::Hangs::loop_3;
    ASSERT_TRUE(bench.run_until([&] { return pins.hung_at.has_value(); }, 10));
    const double heat_s = until_cold(*pins.hung_at, 60);
    bench.run(3);
    EXPECT_EQ(bench.status().state, MachineState::faulted) << "loop 1 sees that it is silent";
    say("loop 3 hangs: loop 1 drives the heaters off", to_seconds(pins.last_step - *pins.hung_at), heat_s);
    EXPECT_LE(heat_s, 2);
    EXPECT_LE(pins.last_step - *pins.hung_at, 2s);
}

TEST_F(Faults, BytesStopInMidJob) {
    ASSERT_TRUE(bench.begin(&pins));
    const std::string begin = "G28\nM109 S200\nG1 X90 E1 F1200\nG1 X10 E2\n";
    auto& jobs = bench.printer().link().jobs;
    ASSERT_TRUE(link::try_push(jobs, link::encode(link::JobBegin{1, begin.size() + 1000})));
    const std::span bytes{reinterpret_cast<const std::uint8_t*>(begin.data()), begin.size()};
    ASSERT_TRUE(link::try_push(jobs, link::encode(link::JobBytes{1, 0, bytes})));
    ASSERT_TRUE(bench.run_until([&] { return bench.status().line >= 4; }, 600)) << bench.fault();
    bench.run(3);
    EXPECT_FALSE(bench.motion().moving) << "at rest at the end of a line, not in mid-air";
    EXPECT_NEAR(bench.metal().position_mm[0], 10, 0.02);
    const double heat_s = until_cold(pins.last_step, 700);
    EXPECT_TRUE(bench.run_until([&] { return bench.status().state == MachineState::paused; }, 30))
        << "and it heats up again first when it is resumed";
    say("bytes stop in mid-job: idle watch", 0, heat_s);
    EXPECT_LE(heat_s, 602);
}

/// The errors of a job at 8000 steps/s, by lines, as its upload is told them.
std::string refusal(const printer::MachineConfig& config) {
    printer::preflight::Preflight preflight{config};
    const std::string job = "G28\nM109 S200\nG1 X90 F6000\nG1 X10\n";
    preflight.feed(std::span{job.data(), job.size()});
    preflight.finish();
    std::string errors;
    for (const auto& error : preflight.facts().errors)
        errors += text<std::string>("line ", error.line, ": ", error.message, '\n');
    return errors;
}

TEST(FaultsBeforeHeat, AStepRateAboveTheMachinesIsRefused) {
    printer::MachineConfig config;
    config.step_cost = 50us;  // 14,000 steps/s at 70 % of the core
    EXPECT_EQ(refusal(config), "");
    config.step_cost = 200us;
    EXPECT_THAT(refusal(config), testing::StartsWith("line 3: the motors together would need 8000 steps/s"));
    config = {};
    config.step_low = 249us;  // of each pulse; with its 1 us high the drivers take 4000 a second
    EXPECT_THAT(refusal(config), testing::StartsWith("line 3: X would need 8000 steps/s"));
}

/// The shortest time from one rise of a pin to the next.
class Rises final : public board::ForwardingPeripherals {
  public:
    explicit Rises(std::uint16_t pin) : pin_(pin) {}
    void pin_written(Instant now, board::PinId pin, board::Level level) override {
        ForwardingPeripherals::pin_written(now, pin, level);
        if (pin.number != pin_ || level != board::Level::high) return;
        if (last_) shortest = std::min(shortest, now - *last_);
        last_ = now;
    }
    Nanoseconds shortest = 1h;

  private:
    std::uint16_t pin_;
    std::optional<Instant> last_;
};

/// What a host sends by itself has no preflight: it is played no quicker than the drivers take it.
TEST(FaultsBeforeHeat, AStepRateAboveTheDriversIsNeverPlayed) {
    printer::MachineConfig config;
    config.step_low = 249us;
    Rises rises{config.axes[printer::Axis::x].step_pin};
    PrinterBench bench{config};
    rises.forward_to(bench.twin());
    ASSERT_TRUE(bench.begin(&rises));
    bench.job("G28 X Y\nG1 X90 F6000\nG1 X10\n");
    ASSERT_TRUE(bench.finish_job()) << bench.fault();
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed) << bench.fault();
    EXPECT_TRUE(bench.report().matches);
    EXPECT_EQ(bench.motion().late_steps, 0U) << "slow by the plan, not by the player";
    EXPECT_GE(rises.shortest, 250us);
    EXPECT_LT(rises.shortest, 252us);
}

}  // namespace
}  // namespace qduino::tests::faults_test
