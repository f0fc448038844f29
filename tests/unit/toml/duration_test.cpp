#include "config/toml_section.h"

#include <gtest/gtest.h>

#include "base/text.h"

namespace qduino::apps::duration_test {
namespace {

TEST(Duration, HasANumberAndAUnit) {
    EXPECT_EQ(parse_duration("4 ms"), 4ms);
    EXPECT_EQ(parse_duration("90us"), 90us);
    EXPECT_EQ(parse_duration("90 µs"), 90us);
    EXPECT_EQ(parse_duration(" 1.5 s "), 1500ms);
    EXPECT_EQ(parse_duration("0 ns"), 0ns);
    EXPECT_EQ(parse_duration("2 min"), 120s);
    EXPECT_EQ(parse_duration("0.25 h"), 900s);
}

TEST(Duration, IsExactOrNothing) {
    EXPECT_EQ(parse_duration("1.001 us"), 1001ns);
    EXPECT_EQ(parse_duration("0.000000001 s"), 1ns);
    EXPECT_EQ(parse_duration("0.1000000000000000000000 s"), 100ms);
    EXPECT_EQ(parse_duration("1.5 ns"), std::nullopt);
    EXPECT_EQ(parse_duration("0.0000000001 s"), std::nullopt);
    EXPECT_EQ(parse_duration("0.00000000005 min"), 3ns);
    EXPECT_EQ(parse_duration("0.00000000001 min"), std::nullopt);
    EXPECT_EQ(parse_duration("9223372036854775807 ns"), Nanoseconds::max());
    EXPECT_EQ(parse_duration("9223372036854775808 ns"), std::nullopt);
    EXPECT_EQ(parse_duration("10000000000 s"), std::nullopt);
    EXPECT_EQ(parse_duration("9223372036.9 s"), std::nullopt);
}

TEST(Duration, AnythingElseIsRefused) {
    for (const char* text :
         {"", "4", "ms", "-4 ms", "4 m s", "4e3 us", "4. ms", ".4 ms", "4,5 ms", "4 days", "4 ms!"}) {
        EXPECT_EQ(parse_duration(text), std::nullopt) << text;
    }
}

TEST(Duration, ReadsBackWhatReportsWrite) {
    for (const Nanoseconds duration :
         {0ns, 1ns, 1500ns, Nanoseconds{10'001us}, Nanoseconds{1010ms}, Nanoseconds{24h}}) {
        EXPECT_EQ(parse_duration(text(duration).view()), duration);
    }
}

}  // namespace
}  // namespace qduino::apps::duration_test
