// Nothing is left hot: every way in which heaters may be on with nobody there to use them. The twin
// judges, from the pins.
#include <gtest/gtest.h>

#include "board/board.h"
#include "tests/scenario/printer/printer_bench.h"

namespace qduino::tests::idle_test {
namespace {

using link::Command;
using link::JobOutcome;
using link::MachineState;

constexpr double kTimeout = 600;
constexpr std::string_view kHeatOnly = "M109 S200\n";

/// Both heaters have had no power since some instant of the last `within_s` seconds, on the pins,
/// and get none for another five minutes.
void expect_goes_off_and_stays_off(PrinterBench& bench, double within_s) {
    ASSERT_TRUE(bench.run_until([&] { return bench.heat().idle_timed_out; }, within_s));
    bench.run(0.2);
    const twin::PrinterState off = bench.metal();
    bench.run(300);
    const twin::PrinterState later = bench.metal();
    for (const int heater : {twin::kHotEnd, twin::kBed}) {
        EXPECT_EQ(later.heater_duty[heater], 0.0);
        EXPECT_EQ(later.heater_off_since[heater], off.heater_off_since[heater]) << "it was on in between";
    }
    EXPECT_LT(later.celsius[twin::kHotEnd], 100);
}

TEST(Idle, AJobThatOnlyHeats) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.job(std::string(kHeatOnly));
    ASSERT_TRUE(bench.finish_job());
    bench.run(kTimeout - 40);  // the last degrees of M109 are no use any more
    EXPECT_FALSE(bench.heat().idle_timed_out);
    EXPECT_EQ(bench.heat().hot_end.target_celsius, 200);
    EXPECT_NEAR(bench.heat().idle_left_s, 30, 11);
    expect_goes_off_and_stays_off(bench, 45);
    EXPECT_EQ(bench.status().state, MachineState::idle);
    EXPECT_EQ(bench.heat().hot_end.target_celsius, 0);
    EXPECT_TRUE(bench.heat().idle_timed_out) << "until a temperature is asked for";
    EXPECT_EQ(bench.heat().idle_left_s, -1);
    EXPECT_NE(bench.replies().find("nobody used the heaters for 600 s"), std::string::npos);
    bench.type("M104 S180");
    bench.run(1);
    EXPECT_FALSE(bench.heat().idle_timed_out);
    EXPECT_EQ(bench.metal().heater_duty[twin::kHotEnd], 1.0);
}

TEST(Idle, ATypedTemperature) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.type("M104 S200");
    bench.type("M140 S60");
    expect_goes_off_and_stays_off(bench, 1200);
    EXPECT_EQ(bench.heat().bed.target_celsius, 0);
}

TEST(Idle, AskingForTheSameTemperatureAgainKeepsItWarm) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.job(std::string(kHeatOnly));
    ASSERT_TRUE(bench.finish_job());
    bench.run(kTimeout - 60);
    bench.type("M104 S200");
    bench.run(120);
    EXPECT_FALSE(bench.heat().idle_timed_out);
    EXPECT_NEAR(bench.heat().idle_left_s, kTimeout - 120, 3);
    expect_goes_off_and_stays_off(bench, kTimeout);
}

/// Heated and paused as `pausing` does it; the heat is lost meanwhile, and had back before the
/// print goes on.
void expect_resume_heats_first(PrinterBench& bench) {
    expect_goes_off_and_stays_off(bench, 1200);
    ASSERT_TRUE(bench.run_until([&] { return bench.status().state == MachineState::paused; }, 400));
    bench.command(Command::resume);
    bench.run(5);
    EXPECT_EQ(bench.heat().hot_end.target_celsius, 200) << "the target that was in force first";
    ASSERT_TRUE(bench.finish_job());
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed) << bench.fault();
    const twin::Report report = bench.report();
    EXPECT_TRUE(report.matches) << (report.differences.empty() ? "" : report.differences[0]);
    EXPECT_EQ(report.cold_extrusion_steps, 0u);
    EXPECT_GT(report.hot_end.minimum_celsius, 195);
}

constexpr std::string_view kHotStart = "G28\nM109 S200\nG92 E0\nG1 X20 Y20 Z0.3 F3000\n";

TEST(Idle, M0) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.job(std::string(kHotStart) + "M0 take the part off\nG1 X60 E2 F1800\nM104 S0\n");
    ASSERT_TRUE(bench.run_until([&] { return bench.status().state == MachineState::paused; }, 600));
    expect_resume_heats_first(bench);
}

TEST(Idle, APause) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.job(std::string(kHotStart) + "G1 X120 E4 F600\nG1 Y90 E8\nG1 X20 E12\nM104 S0\n");
    ASSERT_TRUE(bench.run_until([&] { return bench.metal().position_mm[0] > 60; }, 600));
    bench.command(Command::pause);
    expect_resume_heats_first(bench);
}

TEST(Idle, ADwellIsNoUse) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.job(std::string(kHotStart) + "G4 S900\nG1 X60 E2 F1800\nM104 S0\n");
    expect_resume_heats_first(bench);
}

TEST(Idle, TheServiceIsGone) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    const std::string text = std::string(kHotStart) + "M140 S50\nG1 X60 E2 F1800\n";
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(text.data());
    auto& jobs = bench.printer().link().jobs;
    ASSERT_TRUE(link::try_push(jobs, link::encode(link::JobBegin{1, text.size() + 100})));
    ASSERT_TRUE(link::try_push(jobs, link::encode(link::JobBytes{1, 0, std::span{bytes, text.size()}})));
    expect_goes_off_and_stays_off(bench, 1200);
    EXPECT_EQ(bench.status().state, MachineState::paused) << "it never prints on cold";
    EXPECT_TRUE(bench.status().parked) << "the nozzle does not lie on the part";
}

/// Loop 1 writes an enable pin, and never comes back from it.
class HangingPins final : public board::ForwardingPeripherals {
  public:
    void pin_written(Instant now, board::PinId pin, board::Level level) override {
        ForwardingPeripherals::pin_written(now, pin, level);
        if (armed && pin.number == 4) board::current().sleep_until(now + std::chrono::hours{1000});
    }
    bool armed = false;
};

TEST(Idle, Loop1Hangs) {
    HangingPins pins;
    PrinterBench bench;
    pins.forward_to(bench.twin());
    ASSERT_TRUE(bench.begin(&pins));
    bench.job(std::string(kHeatOnly));
    ASSERT_TRUE(bench.finish_job());
    pins.armed = true;
    bench.type("M84");
    bench.run(1);
    const std::uint64_t heartbeat = bench.status().heartbeat;
    bench.run(5);
    ASSERT_EQ(bench.status().heartbeat, heartbeat) << "loop 1 was to hang";
    expect_goes_off_and_stays_off(bench, kTimeout + 10);
    pins.armed = false;
}

TEST(Idle, APrintIsUseHoweverLong) {
    printer::MachineConfig config;
    config.idle_timeout = Seconds{60};
    PrinterBench bench(config);
    ASSERT_TRUE(bench.begin());
    std::string text(kHotStart);
    for (int lap = 0; lap < 40; ++lap) text += "G1 X120 F600\nG1 X20\n";
    bench.job(text + "M104 S0\n");
    ASSERT_TRUE(bench.finish_job(5000));
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed);
    EXPECT_EQ(bench.replies().find("nobody used"), std::string::npos);
    EXPECT_TRUE(bench.report().matches);
}

TEST(Idle, WaitingForACoolBedIsNoIdleness) {
    printer::MachineConfig config;
    config.idle_timeout = Seconds{120};
    PrinterBench bench(config);
    ASSERT_TRUE(bench.begin());
    bench.job("M190 S80\nM190 R45\nM140 S0\n");
    ASSERT_TRUE(bench.finish_job(20000));
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed);
    EXPECT_EQ(bench.replies().find("nobody used"), std::string::npos) << bench.replies();
}

TEST(Idle, ZeroNeverSwitchesOff) {
    printer::MachineConfig config;
    config.idle_timeout = Seconds{0};
    PrinterBench bench(config);
    ASSERT_TRUE(bench.begin());
    bench.job(std::string(kHeatOnly));
    ASSERT_TRUE(bench.finish_job());
    bench.run(4000);
    EXPECT_EQ(bench.heat().hot_end.target_celsius, 200);
    EXPECT_EQ(bench.heat().idle_left_s, -1);
    EXPECT_NEAR(bench.metal().celsius[twin::kHotEnd], 200, 4);
}

}  // namespace
}  // namespace qduino::tests::idle_test
