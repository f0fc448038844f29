#include "twin/compensation.h"

#include <gtest/gtest.h>

#include "twin/advance_watch.h"

namespace qduino::twin::compensation_test {
namespace {

Compensation after(std::initializer_list<const char*> lines, const Machine& machine = {}) {
    Compensation compensation{machine};
    for (const char* line : lines) compensation.run(LineReader::parse(line));
    return compensation;
}

double sideways(std::initializer_list<const char*> lines) { return after(lines).reach(Machine{}).mm[0]; }

TEST(Compensation, NothingAskedNothingAllowed) {
    for (const double mm : after({}).reach(Machine{}).mm) EXPECT_EQ(mm, 0);
    EXPECT_EQ(sideways({"M593 F40", "M593 F0"}), 0);
    EXPECT_EQ(sideways({"SET_INPUT_SHAPER SHAPER_FREQ_X=40 SHAPER_TYPE=none"}), 0);
}

// ZV without damping: two halves, a quarter of a period before and behind.
TEST(Compensation, MomentsOfAKnownShaper) {
    const ShaperMoments moments = moments_of({Shaper::zv, 50, 0});
    EXPECT_NEAR(moments.reach_s, 0.010, 1e-15);
    EXPECT_NEAR(moments.one_sided_s, 0.5 * 0.005, 1e-15);
    EXPECT_NEAR(moments.second_s2, 0.005 * 0.005, 1e-15);
    EXPECT_EQ(moments_of({Shaper::none, 50, 0}).reach_s, 0);
}

TEST(Compensation, ReadsEveryDialect) {
    const double mzv = sideways({"M593 P\"mzv\" F40 S0.1"});
    EXPECT_GT(mzv, 0.1);
    EXPECT_DOUBLE_EQ(sideways({"M593 T2 F40"}), mzv);
    EXPECT_DOUBLE_EQ(sideways({"SET_INPUT_SHAPER SHAPER_FREQ_X=40 SHAPER_FREQ_Y=40"}), mzv);
    EXPECT_LT(sideways({"M593 T2 F80"}), mzv);
    EXPECT_LT(sideways({"M593 T2 F40", "M593 Y F0"}), mzv);
    EXPECT_EQ(after({"M900 K0.05"}).advance_s(), 0.05);
    EXPECT_EQ(after({"M572 D0 S0.06"}).advance_s(), 0.06);
    EXPECT_EQ(after({"M572 D1 S0.06"}).advance_s(), 0);
    const Compensation klipper = after({"SET_PRESSURE_ADVANCE ADVANCE=0.07 SMOOTH_TIME=0.02"});
    EXPECT_EQ(klipper.advance_s(), 0.07);
    EXPECT_EQ(klipper.smooth_s(), 0.02);
    EXPECT_EQ(after({"SET_PRESSURE_ADVANCE SMOOTH_TIME=0.02"}).smooth_s(), 0);
}

/// 2 mm/s of filament at 96 steps/mm, each step `lead_s` seconds of it ahead of the path.
double gain_of(double lead_s, double advance_s) {
    AdvanceWatch watch;
    for (int step = 0; step < 2000; ++step) {
        const double built_mm = step / 96.0;
        const double at_s = built_mm / 2;
        watch.on_push(kEpoch + from_seconds(at_s), built_mm - lead_s * 2, built_mm, advance_s, 0.04);
    }
    EXPECT_GE(watch.stretches(), AdvanceWatch::kStretchesMin);
    return watch.gain();
}

TEST(AdvanceWatch, MeasuresHowFarTheFilamentIsAhead) {
    EXPECT_NEAR(gain_of(0.05, 0.05), 1, 1e-3);
    EXPECT_NEAR(gain_of(0.025, 0.05), 0.5, 1e-3);
    EXPECT_NEAR(gain_of(0, 0.05), 0, 1e-3);
}

TEST(AdvanceWatch, AnUnevenFlowSaysNothing) {
    AdvanceWatch watch;
    double asked = 0;
    for (int step = 0; step < 2000; ++step) {
        asked += step % 8 < 4 ? 0.001 : 0.02;
        if (step % 8 == 0) watch.interrupt();
        watch.on_push(kEpoch + from_seconds(step * 0.01), asked, asked, 0.05, 0.04);
    }
    EXPECT_EQ(watch.stretches(), 0u);
    EXPECT_EQ(watch.gain(), 1);
}

}  // namespace
}  // namespace qduino::twin::compensation_test
