#include "terminal/human.h"

#include <gtest/gtest.h>

namespace qduino::apps::human_test {
namespace {

TEST(Human, DurationsHaveThreeDigitsThatCount) {
    EXPECT_EQ(human_duration(0ns), "0 ns");
    EXPECT_EQ(human_duration(734ns), "734 ns");
    EXPECT_EQ(human_duration(1us), "1 us");
    EXPECT_EQ(human_duration(12'743ns), "12.7 us");
    EXPECT_EQ(human_duration(71'680ns), "71.7 us");
    EXPECT_EQ(human_duration(787'111ns), "787 us");
    EXPECT_EQ(human_duration(4'447'134ns), "4.45 ms");
    EXPECT_EQ(human_duration(30ms), "30 ms");
    EXPECT_EQ(human_duration(999'800ns), "1 ms");
    EXPECT_EQ(human_duration(1010ms), "1.01 s");
    EXPECT_EQ(human_duration(24h), "86400 s");
    EXPECT_EQ(human_duration(-1500us), "-1.5 ms");
}

TEST(Human, CountsHaveTheirPlural) {
    EXPECT_EQ(counted(1, "loop"), "1 loop");
    EXPECT_EQ(counted(0, "library"), "0 libraries");
    EXPECT_EQ(counted(0, "loop"), "0 loops");
    EXPECT_EQ(counted(3, "loop"), "3 loops");
}

}  // namespace
}  // namespace qduino::apps::human_test
