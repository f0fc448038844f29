#include "printer/gcode/text.h"

#include <gtest/gtest.h>

#include <bit>
#include <clocale>
#include <cstdlib>
#include <random>
#include <string>

namespace qduino::printer::gcode::text_test {
namespace {

struct NumberCase {
    const char* text;
    bool ok;
    double value;
    const char* left;
};

TEST(TakeNumber, ReadsDecimalsAndNothingElse) {
    const NumberCase cases[] = {
        {"10", true, 10, ""},
        {"-10.5", true, -10.5, ""},
        {"+3", true, 3, ""},
        {".25", true, 0.25, ""},
        {"-.25", true, -0.25, ""},
        {"5.", true, 5, ""},
        {"0", true, 0, ""},
        {"007", true, 7, ""},
        {"1e5", true, 1, "e5"},
        {"1E5", true, 1, "E5"},
        {"0x10", true, 0, "x10"},
        {"1.2.3", true, 1.2, ".3"},
        {"12abc", true, 12, "abc"},
        {"1,5", true, 1, ",5"},
        {"", false, 0, ""},
        {"-", false, 0, "-"},
        {".", false, 0, "."},
        {"-.", false, 0, "-."},
        {"+-1", false, 0, "+-1"},
        {"--1", false, 0, "--1"},
        {"inf", false, 0, "inf"},
        {"nan", false, 0, "nan"},
        {"-inf", false, 0, "-inf"},
        {" 1", false, 0, " 1"},
        {"0.1", true, 0.1, ""},
        {"1374.45976", true, 1374.45976, ""},
        {"123456789012345678", true, 123456789012345678.0, ""},
    };
    for (const NumberCase& c : cases) {
        std::string_view text = c.text;
        const auto value = take_number(text);
        EXPECT_EQ(value.has_value(), c.ok) << c.text;
        if (value) {
            EXPECT_EQ(*value, c.value) << c.text;
        }
        EXPECT_EQ(text, c.left) << c.text;
    }
}

TEST(TakeNumber, RefusesWhatIsTooLargeForADouble) {
    const std::string digits(400, '9');
    std::string_view text = digits;
    EXPECT_FALSE(take_number(text));
    EXPECT_EQ(text.size(), digits.size());
}

TEST(TakeNumber, DoesNotDependOnTheLocale) {
    // "C.UTF-8" is everywhere; a comma locale, where there is one, must change nothing either.
    const std::string before = std::setlocale(LC_ALL, nullptr);
    for (const char* name : {"C.UTF-8", "de_DE.UTF-8", "fr_FR.UTF-8"}) {
        if (std::setlocale(LC_ALL, name) == nullptr) continue;
        std::string_view text = "1.5";
        EXPECT_EQ(take_number(text), 1.5) << name;
        EXPECT_EQ(qduino::text(Fixed{1.5}).view(), "1.50") << name;
    }
    std::setlocale(LC_ALL, before.c_str());
}

TEST(TakeInteger, StopsAtTheFirstOtherByteAndRefusesOverflow) {
    std::string_view text = "42*7";
    EXPECT_EQ(take_integer(text), 42U);
    EXPECT_EQ(text, "*7");
    text = "18446744073709551615";
    EXPECT_EQ(take_integer(text), ~std::uint64_t{0});
    text = "18446744073709551616";
    EXPECT_FALSE(take_integer(text));
    text = "-1";
    EXPECT_FALSE(take_integer(text));
}

TEST(AppendPrintable, KeepsUtf8AndReplacesEveryOtherByte) {
    struct Case {
        std::string in, out;
    };
    const Case cases[] = {
        {"plain", "plain"},
        {"d\xC3\xA9j\xC3\xA0 vu \xE2\x82\xAC \xF0\x9F\x96\xA8",
         "d\xC3\xA9j\xC3\xA0 vu \xE2\x82\xAC \xF0\x9F\x96\xA8"},
        {"tab\there\x1B[31m", "tab?here?[31m"},
        {"\x7F", "?"},
        {"\xC0\xAF", "??"},            // overlong
        {"\xED\xA0\x80", "???"},       // a surrogate
        {"\xF4\x90\x80\x80", "????"},  // beyond U+10FFFF
        {"\xE2\x82", "??"},            // cut short
        {"\xC2\x9B", "??"},            // a C1 control character
        {"\xFF\xFE", "??"},
    };
    for (const Case& c : cases) {
        FixedString<64> out;
        EXPECT_TRUE(append_printable(out, c.in));
        EXPECT_EQ(out.view(), c.out);
    }
}

TEST(AppendPrintable, NeverCutsACharacterInTwo) {
    FixedString<4> out;
    EXPECT_FALSE(append_printable(out, "ab\xE2\x82\xAC"));
    EXPECT_EQ(out.view(), "ab");
}

/// The quick way (15 digits) and the library's must not differ by a bit, wherever one ends.
TEST(TakeNumber, GivesTheLibrarysNumber) {
    for (unsigned seed = 1; seed <= 20; ++seed) {
        SCOPED_TRACE(seed);
        std::mt19937 random{seed};
        const auto digits = [&](unsigned most) {
            std::string text;
            for (unsigned count = random() % (most + 1); count > 0; --count)
                text += static_cast<char>('0' + random() % 10);
            return text;
        };
        for (int i = 0; i < 2000; ++i) {
            const std::string number = std::string{"-"}.substr(random() % 2) + digits(1 + random() % 18) +
                                       "." + digits(1 + random() % 24);
            std::string_view text = number;
            const auto value = take_number(text);
            if (number.size() < 2 || number == "-.") {
                EXPECT_FALSE(value) << number;
                continue;
            }
            ASSERT_TRUE(value) << number;
            EXPECT_TRUE(text.empty()) << number;
            const double expected = std::strtod(number.c_str(), nullptr);
            EXPECT_EQ(std::bit_cast<std::uint64_t>(*value), std::bit_cast<std::uint64_t>(expected)) << number;
        }
    }
}

}  // namespace
}  // namespace qduino::printer::gcode::text_test
