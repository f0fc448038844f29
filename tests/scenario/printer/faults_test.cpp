// Each fault that is not of the heat, and how long the machine takes until it is safe: nothing
// moves, and nothing is hot that nobody watches. One row of the table in docs/faults.md each; the
// times are virtual, and printed.
#include <gtest/gtest.h>

#include <bitset>

#include "printer/preflight/preflight.h"
#include "tests/scenario/printer/forwarding_pins.h"
#include "tests/scenario/printer/printer_bench.h"

namespace qduino::tests::faults_test {
namespace {

using link::JobOutcome;
using link::MachineState;

/// Sees when the machine was last stepped, and can hang a loop: it sleeps in its own write.
class FaultyPins final : public ForwardingPins {
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
        next_->pin_written(now, pin, level);
        if (enables_.test(pin.number)) hang(Hangs::loop_1, now);
        if (steps_.test(pin.number)) hang(Hangs::loop_2, now);
    }
    Result<void> i2c_transfer(Instant now, board::I2cBus bus, board::I2cAddress address,
                              std::span<const std::uint8_t> out, std::span<std::uint8_t> in) override {
        hang(Hangs::loop_3, now);
        return next_->i2c_transfer(now, bus, address, out, in);
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
        for (int i = 0; i < 200; ++i) job += i % 2 == 0 ? "G1 X90 E1 F1200\nG92 E0\n" : "G1 X10 E1\nG92 E0\n";
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

TEST(FaultsBeforeHeat, AStepRateAboveTheMachinesIsRefused) {
    printer::MachineConfig config;
    config.step_cost = 50us;  // 14,000 steps/s at 70 % of the core
    printer::preflight::Preflight preflight{config};
    const std::string job = "G28\nM109 S200\nG1 X90 F6000\nG1 X10\n";  // 8,000 steps/s
    preflight.feed(std::span{job.data(), job.size()});
    preflight.finish();
    EXPECT_TRUE(preflight.facts().errors.empty());
    config.step_cost = 200us;
    printer::preflight::Preflight slow{config};
    slow.feed(std::span{job.data(), job.size()});
    slow.finish();
    ASSERT_FALSE(slow.facts().errors.empty());
}

}  // namespace
}  // namespace qduino::tests::faults_test
