// Colours stand where a terminal shows them, and take no room.
#include "terminal/colour.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include "posix/unique_fd.h"

namespace qduino::apps::colour_test {
namespace {

TEST(Colour, StandsOnATerminalThatShowsItUnlessSomebodySaysNo) {
    const posix::UniqueFd terminal{::posix_openpt(O_RDWR | O_NOCTTY)};
    const posix::UniqueFd file{::open("/dev/null", O_WRONLY)};
    ASSERT_TRUE(terminal.valid() && file.valid());
    ::setenv("TERM", "xterm-256color", 1);
    ::unsetenv("NO_COLOR");
    EXPECT_TRUE(wants_colour(terminal.get()));
    EXPECT_FALSE(wants_colour(file.get()));
    ::setenv("NO_COLOR", "", 1);
    EXPECT_TRUE(wants_colour(terminal.get())) << "no-color.org: an empty one counts for nothing";
    ::setenv("NO_COLOR", "1", 1);
    EXPECT_FALSE(wants_colour(terminal.get()));
    ::unsetenv("NO_COLOR");
    ::setenv("TERM", "dumb", 1);
    EXPECT_FALSE(wants_colour(terminal.get()));
}

TEST(Colour, OutcomesAreRedAndGreen) {
    const std::string words =
        "core 0: admitted\nloop 4 is refused on core 0, would be admitted with less.\nx REFUSED";
    EXPECT_EQ(with_outcomes(words, false), words);
    EXPECT_EQ(with_outcomes(words, true), "core 0: " + painted("admitted", Tone::good, true) +
                                              "\nloop 4 is " + painted("refused", Tone::bad, true) +
                                              " on core 0, would be admitted with less.\nx " +
                                              painted("REFUSED", Tone::bad, true));
}

TEST(Colour, TakesNoColumns) {
    EXPECT_EQ(painted("REFUSED", Tone::bad, false), "REFUSED");
    EXPECT_EQ(painted("loop 1", Tone::plain, true), "loop 1");
    const std::string red = painted("REFUSED", Tone::bad, true);
    EXPECT_NE(red, "REFUSED");
    EXPECT_EQ(columns_of(red), 7u);
    EXPECT_EQ(columns_of("▁▔ " + red + "█"), 11u);
    EXPECT_EQ(columns_of("\x1b["), 0u);
}

}  // namespace
}  // namespace qduino::apps::colour_test
