#include "base/quantity.h"

#include <gtest/gtest.h>

#include <type_traits>

namespace qduino::quantity_test {
namespace {

static_assert(std::is_same_v<decltype(Millimetres{} / Seconds{}), MillimetresPerSecond>);
static_assert(std::is_same_v<decltype(MillimetresPerSecond{} / Seconds{}), MillimetresPerSecond2>);
static_assert(std::is_same_v<decltype(MillimetresPerSecond{} * Seconds{}), Millimetres>);
static_assert(std::is_same_v<decltype(Millimetres{} / Millimetres{}), double>, "a ratio has no unit");
static_assert(!std::is_convertible_v<double, Millimetres>, "a bare number is not a length");
static_assert(!std::is_convertible_v<Millimetres, MillimetresPerSecond>);
static_assert(!std::is_convertible_v<Millimetres, double>, "giving up a unit is written out");
static_assert(sizeof(Millimetres) == sizeof(double));

TEST(Quantity, ArithmeticCarriesUnits) {
    const Millimetres way = 125_mm_s * Seconds{2.0};
    EXPECT_EQ(way, 250_mm);
    EXPECT_EQ(way / Seconds{0.5}, MillimetresPerSecond{500});
    EXPECT_EQ(way / 50_mm, 5.0);
    EXPECT_EQ(3000_mm_s2 * Seconds{0.1}, 300_mm_s);
    EXPECT_EQ(2.0 * 1.5_mm + -1_mm, 2_mm);
    EXPECT_LT(1_mm, 1.5_mm);
}

TEST(Quantity, CompoundAssignment) {
    Millimetres x{1};
    x += 2_mm;
    x -= 0.5_mm;
    x *= 4;
    EXPECT_EQ(x, 10_mm);
    EXPECT_EQ(x / 4.0, 2.5_mm);
}

TEST(Celsius, DifferencesAreKelvin) {
    EXPECT_EQ(210_celsius - 25_celsius, 185.0);
    EXPECT_EQ(25_celsius + 10.5, Celsius{35.5});
    EXPECT_LT(0_celsius + -2.0, 0_celsius);
}

}  // namespace
}  // namespace qduino::quantity_test
