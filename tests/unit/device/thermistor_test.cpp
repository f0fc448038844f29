#include "device/thermistor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace qduino::device::thermistor_test {
namespace {

TEST(Thermistor, IsItsNominalResistanceAt25Degrees) {
    EXPECT_NEAR(Thermistor{}.resistance_ohm(Celsius{25}), 100e3, 1e-6);
    EXPECT_NEAR(Thermistor{}.fraction(Celsius{25}), 100e3 / 104.7e3, 1e-12);
}

TEST(Thermistor, FollowsTheBetaLaw) {
    const Thermistor thermistor(10e3, 3950, 4700);
    for (double celsius = -30; celsius <= 300; celsius += 7) {
        const double expected = 10e3 * std::exp(3950 * (1 / (celsius + 273.15) - 1 / 298.15));
        EXPECT_NEAR(thermistor.resistance_ohm(Celsius{celsius}) / expected, 1.0, 1e-12) << celsius;
    }
}

// Rounded resistances of the EPCOS data sheet's curve 8304 (100 kΩ): the Beta law is a fit, good to
// some per cent.
TEST(Thermistor, DefaultIsNearTheDataSheetsCurve) {
    EXPECT_NEAR(Thermistor{}.resistance_ohm(Celsius{100}) / 6.5e3, 1.0, 0.06);
    EXPECT_NEAR(Thermistor{}.resistance_ohm(Celsius{200}) / 0.64e3, 1.0, 0.15);
}

TEST(Thermistor, ThereAndBackIsTheSameTemperature) {
    constexpr std::uint64_t kSeed = 20170418;
    std::mt19937_64 random(kSeed);
    std::uniform_real_distribution<double> ohm25(5e3, 200e3), beta(3000, 4800), pull_up(1000, 10e3),
        celsius(-10, 300);
    for (int round = 0; round < 5000; ++round) {
        const Thermistor thermistor(ohm25(random), beta(random), pull_up(random));
        const double wanted = celsius(random);
        const double fraction = thermistor.fraction(Celsius{wanted});
        if (fraction >= Thermistor::kOpenFraction || fraction <= Thermistor::kShortFraction) continue;
        const Result<Celsius> got = thermistor.celsius(fraction);
        ASSERT_TRUE(got.ok()) << "seed " << kSeed << " round " << round;
        ASSERT_NEAR(got->value(), wanted, 1e-6) << "seed " << kSeed << " round " << round;
    }
}

TEST(Thermistor, FractionFallsStrictlyWithTemperature) {
    const Thermistor thermistor;
    double before = 1.0;
    for (double celsius = -40; celsius <= 400; celsius += 0.25) {
        const double fraction = thermistor.fraction(Celsius{celsius});
        ASSERT_LT(fraction, before) << celsius;
        before = fraction;
    }
}

TEST(Thermistor, OpenAndShortAreFaultsThatSayWhich) {
    const Thermistor thermistor;
    for (const double fraction : {1.0, 0.9985, 2.0, std::nan("")}) {
        const Result<Celsius> got = thermistor.celsius(fraction);
        ASSERT_FALSE(got.ok()) << fraction;
        EXPECT_EQ(got.error().code, ErrorCode::faulted);
        EXPECT_THAT(std::string(got.error().message.view()), testing::HasSubstr("open"));
    }
    for (const double fraction : {0.0, 0.004, -1.0}) {
        const Result<Celsius> got = thermistor.celsius(fraction);
        ASSERT_FALSE(got.ok()) << fraction;
        EXPECT_THAT(std::string(got.error().message.view()), testing::HasSubstr("short"));
    }
    EXPECT_TRUE(thermistor.celsius(thermistor.fraction(Celsius{0})).ok());
    EXPECT_TRUE(thermistor.celsius(thermistor.fraction(Celsius{300})).ok());
}

}  // namespace
}  // namespace qduino::device::thermistor_test
