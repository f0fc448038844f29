#include "printer/motion/shaper.h"

#include <gtest/gtest.h>

#include <complex>

namespace qduino::printer::motion::shaper_test {
namespace {

constexpr ShaperType kTypes[]{ShaperType::zv, ShaperType::zvd, ShaperType::mzv, ShaperType::ei,
                              ShaperType::two_hump_ei};

/// What is left of the swing of one impulse, behind the shaper's last one: a mass on a spring of
/// `hz` and `damping`, each impulse's swing added up as a rotating arrow that has died down.
double vibration(const Impulses& impulses, double hz, double damping) {
    const double omega = 2 * std::numbers::pi * hz;
    const double damped = omega * std::sqrt(1 - damping * damping);
    std::complex<double> swing = 0;
    for (std::size_t i = 0; i < impulses.count; ++i) {
        const double since_s = impulses.past_s() + impulses.ahead_s[i];
        swing += impulses.share[i] * std::exp(-damping * omega * since_s) * std::polar(1.0, damped * since_s);
    }
    const double whole_s = impulses.past_s() + impulses.future_s();
    return std::abs(swing) / std::exp(-damping * omega * whole_s);
}

TEST(Shaper, KeepsPlaceAndConstantSpeed) {
    for (const ShaperType type : kTypes) {
        for (const double damping : {0.0, 0.1, 0.4}) {
            const Impulses impulses = impulses_of({type, 40, damping});
            double sum = 0, moment = 0;
            for (std::size_t i = 0; i < impulses.count; ++i) {
                sum += impulses.share[i];
                moment += impulses.share[i] * impulses.ahead_s[i];
                EXPECT_GT(impulses.share[i], 0);
            }
            EXPECT_NEAR(sum, 1, 1e-15);
            EXPECT_NEAR(moment, 0, 1e-17);
        }
    }
}

// The definition: no swing is left at the shaper's own frequency and damping; of EI 5 %. Two humps
// of 5 % are on both sides of it.
TEST(Shaper, LeavesNoSwingAtItsFrequency) {
    for (const double hz : {25.0, 40.0, 90.0}) {
        for (const ShaperType type : {ShaperType::zv, ShaperType::zvd, ShaperType::mzv}) {
            EXPECT_NEAR(vibration(impulses_of({type, hz, 0.1}), hz, 0.1), 0, 1e-12) << static_cast<int>(type);
            EXPECT_GT(vibration(impulses_of({type, hz, 0.1}), hz * 1.5, 0.1), 0.05);
        }
        EXPECT_NEAR(vibration(impulses_of({ShaperType::ei, hz, 0}), hz, 0), 0.05, 1e-12);
        const Impulses two_hump = impulses_of({ShaperType::two_hump_ei, hz, 0});
        EXPECT_NEAR(vibration(two_hump, hz, 0), 0, 1e-12);
        double hump = 0;
        for (double part = 0; part <= 0.3; part += 0.001)
            hump = std::max(hump, vibration(two_hump, hz * (1 + part), 0));
        EXPECT_NEAR(hump, 0.05, 0.02);
    }
}

// Singhose 1996, figure 6: EI stays below 5 % for ±20 % of the frequency, two humps for ±30 %.
TEST(Shaper, ForgivesAWrongFrequency) {
    const Impulses ei = impulses_of({ShaperType::ei, 40, 0});
    const Impulses two_hump = impulses_of({ShaperType::two_hump_ei, 40, 0});
    for (double part = -0.18; part <= 0.18; part += 0.01) EXPECT_LE(vibration(ei, 40 * (1 + part), 0), 0.051);
    for (double part = -0.28; part <= 0.28; part += 0.01)
        EXPECT_LE(vibration(two_hump, 40 * (1 + part), 0), 0.052) << part;
    EXPECT_GT(vibration(impulses_of({ShaperType::zv, 40, 0}), 40 * 1.18, 0), 0.2);
}

TEST(Shaper, NoneIsThePositionItself) {
    for (const ShaperConfig& shaper : {ShaperConfig{}, ShaperConfig{ShaperType::mzv, 0, 0.1}}) {
        const Impulses impulses = impulses_of(shaper);
        EXPECT_EQ(impulses.count, 1u);
        EXPECT_EQ(impulses.share[0], 1);
        EXPECT_EQ(impulses.future_s() + impulses.past_s(), 0);
    }
}

}  // namespace
}  // namespace qduino::printer::motion::shaper_test
