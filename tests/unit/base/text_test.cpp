#include "base/text.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <string>

namespace qduino::text_test {
namespace {

TEST(Text, JoinsPiecesOfEveryKind) {
    EXPECT_EQ(
        text("R = ", -12, '/', std::uint64_t{18'446'744'073'709'551'615U}, " of ", std::string{"x"}).view(),
        "R = -12/18446744073709551615 of x");
    EXPECT_EQ(text<std::string>("line ", std::uint8_t{65}), "line 65");
}

TEST(Text, AppendsBehindWhatIsThere) {
    std::string out = "a";
    EXPECT_EQ(write(out, 1, "b"), "a1b");
}

TEST(Text, AFixedStringCutsWhatDoesNotFit) { EXPECT_EQ((text<FixedString<4>>("abc", 123).view()), "abc1"); }

TEST(Text, NumbersWithDecimals) {
    EXPECT_EQ(text(Fixed{2.345, 1}, ' ', Fixed{-0.5, 0}, ' ', Fixed{1e14, 2}).view(),
              "2.3 -0 100000000000000.00");
    EXPECT_EQ(text(Fixed{1e300, 2}).view(), "?");
}

TEST(Text, NumbersInTheFewestDigits) {
    EXPECT_EQ(text(Shortest{150}, ' ', Shortest{0.2}, ' ', Shortest{-1e6}, ' ', Shortest{0}).view(),
              "150 0.2 -1000000 0");
    EXPECT_EQ(text(Shortest{1e300}, ' ', Shortest{-1e-9}).view(), "1e+300 -1e-09");
}

TEST(Text, DurationsAreExactInTheLargestUnitThatReadsWell) {
    EXPECT_EQ(text(Nanoseconds{0}, ", ", 999ns, ", ", 1us, ", ", 1500ns).view(),
              "0 ns, 999 ns, 1 us, 1.5 us");
    EXPECT_EQ(text(10001us, ", ", 1000001ns, ", ", 2s).view(), "10.001 ms, 1000.001 us, 2 s");
    EXPECT_EQ(text(-1500us, ", ", -5ns, ", ", 1050us).view(), "-1.5 ms, -5 ns, 1.05 ms");
    EXPECT_EQ(text(100ms, ", ", 1010ms, ", ", 1s + 1us, ", ", 1s + 1ns, ", ", 24h).view(),
              "100 ms, 1.01 s, 1000.001 ms, 1000000.001 us, 86400 s");
}

}  // namespace
}  // namespace qduino::text_test
