#include "base/words.h"

#include <gtest/gtest.h>

namespace qduino::words_test {
namespace {

enum class Colour : unsigned char { red = 1, green, blue };
constexpr Words<Colour::red, Colour::blue> kColours{"red", "green", "blue"};

template <typename... Texts>
constexpr bool takes = std::is_constructible_v<Words<Colour::red, Colour::blue>, Texts...>;

TEST(Words, EachValueHasItsWord) {
    EXPECT_EQ(kColours(Colour::red), "red");
    EXPECT_EQ(kColours(Colour::blue), "blue");
}

TEST(Words, AValueThatIsNoneHasTheLastWord) {
    EXPECT_EQ(kColours(Colour{0}), "blue");
    EXPECT_EQ(kColours(Colour{200}), "blue");
}

TEST(Words, OneWordTooFewOrTooManyDoesNotCompile) {
    EXPECT_TRUE((takes<const char*, const char*, const char*>));
    EXPECT_FALSE((takes<const char*, const char*>));
    EXPECT_FALSE((takes<const char*, const char*, const char*, const char*>));
}

}  // namespace
}  // namespace qduino::words_test
