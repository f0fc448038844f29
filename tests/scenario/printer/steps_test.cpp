// Step instants of the whole printer, as they leave the pins, against the motion's own equations.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/scenario/printer/printer_bench.h"

namespace qduino::tests::steps_test {
namespace {

/// Notes the instant of every rising edge of X.
class EdgeNotes final : public board::ForwardingPeripherals {
  public:
    void pin_written(Instant now, board::PinId pin, board::Level level) override {
        const bool high = level == board::Level::high;
        if (pin.number == 2 && high && !high_) rises.push_back(now);
        if (pin.number == 2) high_ = high;
        ForwardingPeripherals::pin_written(now, pin, level);
    }
    std::vector<Instant> rises;

  private:
    bool high_ = false;
};

/// Seconds from standstill until `mm` of a move of 100 mm at 200 mm/s and 3000 mm/s² are covered.
double trapezoid_time_s(double mm) {
    const double a = 3000, v = 200, length = 100;
    const double ramp = v * v / (2 * a);
    if (mm <= ramp) return std::sqrt(2 * mm / a);
    if (mm <= length - ramp) return v / a + (mm - ramp) / v;
    const double total = 2 * v / a + (length - 2 * ramp) / v;
    return total - std::sqrt(2 * (length - mm) / a);
}

TEST(Steps, OneLongMoveIsTheTrapezoidWithinAMicrosecondAtEveryStep) {
    printer::MachineConfig config;
    config.axes[0].max_speed = 200_mm_s;
    config.axes[0].max_acceleration = 3000_mm_s2;
    EdgeNotes notes;
    PrinterBench bench(config);
    notes.forward_to(bench.twin());
    ASSERT_TRUE(bench.begin(&notes));
    bench.type("G28");
    ASSERT_TRUE(bench.run_until([&] { return bench.status().homed[2]; }, 60));
    bench.run(1);
    notes.rises.clear();
    bench.type("G1 X100 F12000");
    bench.run(3);
    ASSERT_EQ(notes.rises.size(), 8000u);
    const double first_s = trapezoid_time_s(0.5 / 80);
    for (std::size_t k = 0; k < notes.rises.size(); ++k) {
        const double asked_s = trapezoid_time_s((static_cast<double>(k) + 0.5) / 80) - first_s;
        const double built_s = to_seconds(notes.rises[k] - notes.rises[0]);
        ASSERT_NEAR(built_s, asked_s, 1e-6) << "step " << k;
    }
}

TEST(Steps, TwoRunsGiveTheSameSteps) {
    std::vector<std::vector<Instant>> runs;
    for (int run = 0; run < 2; ++run) {
        EdgeNotes notes;
        PrinterBench bench;
        notes.forward_to(bench.twin());
        ASSERT_TRUE(bench.begin(&notes));
        bench.job("G28\nG1 X30 Y10 F6000\nG1 X5 Y40\nG1 X50 Y50\n");
        ASSERT_TRUE(bench.finish_job(60));
        runs.push_back(notes.rises);
    }
    EXPECT_GT(runs[0].size(), 5000u);
    EXPECT_EQ(runs[0], runs[1]);
}

}  // namespace
}  // namespace qduino::tests::steps_test
