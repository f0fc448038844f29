// A format of a sketch, against the C library's own reading of the same format without its l.
#include "arduino/core/narrow_format.h"

#include <gtest/gtest.h>

#include <cerrno>
#include <cstdint>
#include <random>
#include <string>

extern "C" {
int qduino_snprintf(char* text, std::size_t size, const char* format, ...);
int qduino_sscanf(const char* text, const char* format, ...);
std::int32_t qduino_strtol(const char* text, char** end, int base);
std::uint32_t qduino_strtoul(const char* text, char** end, int base);
}

namespace qduino::arduino::formats_test {
namespace {

std::string narrow(const std::string& format, FormatKind kind = FormatKind::print) {
    return NarrowFormat(format.c_str(), kind).text();
}

TEST(Formats, ASingleLOfAWholeNumberGoes) {
    EXPECT_EQ(narrow("a %ld b %5lu|%-08lx|%+.3li|%*lo|%lX|%ln %1$ld"),
              "a %d b %5u|%-08x|%+.3i|%*o|%X|%n %1$d");
    for (const char* text :
         {"", "%", "%l", "100%% load %%ld", "%lld %llu %lf %Lf %lc %ls %zu %jd %td %hd %d %s"})
        EXPECT_EQ(narrow(text), text);
}

TEST(Formats, ASetOfScanfIsNoConversion) {
    EXPECT_EQ(narrow("%[%ld] %*ld %5lu %[]%ld] %[^]%ld]x%ld", FormatKind::scan),
              "%[%ld] %*d %5u %[]%ld] %[^]%ld]x%d");
    EXPECT_EQ(narrow("%[%ld", FormatKind::scan), "%[%ld");
}

TEST(Formats, ALongFormatIsWhole) {
    std::string format, expected;
    for (int i = 0; i < 200; ++i) format += "%ld,", expected += "%d,";
    EXPECT_EQ(narrow(format), expected);
}

TEST(Formats, PrintAndScanWhatHas32Bits) {
    char text[80];
    const int minus = -1;
    EXPECT_EQ(qduino_snprintf(text, sizeof text, "%ld|%lu|%lld|%s", minus, 4294967295U, -5LL, "x"), 18);
    EXPECT_STREQ(text, "-1|4294967295|-5|x");
    int got[2] = {5, 77};
    EXPECT_EQ(qduino_sscanf("-5 9", "%ld", &got[0]), 1);
    EXPECT_EQ(got[0], -5);
    EXPECT_EQ(got[1], 77) << "what stands behind it stays";
}

TEST(Formats, NumbersInTextsEndAt32Bits) {
    EXPECT_EQ(qduino_strtol("3000000000", nullptr, 10), 2147483647);
    EXPECT_EQ(qduino_strtol("-3000000000", nullptr, 10), -2147483648LL);
    EXPECT_EQ(errno, ERANGE);
    EXPECT_EQ(qduino_strtol("-12x", nullptr, 0), -12);
    EXPECT_EQ(qduino_strtoul("-1", nullptr, 10), 4294967295U);
    EXPECT_EQ(qduino_strtoul("0xffffffff", nullptr, 0), 4294967295U);
    EXPECT_EQ(qduino_strtoul("99999999999999999999", nullptr, 10), 4294967295U);
    EXPECT_EQ(qduino_strtoul("4294967296", nullptr, 10), 4294967295U);
    EXPECT_EQ(qduino_strtoul(" -99999999999999999999", nullptr, 10), 4294967295U);
}

/// A random format, with an l before its letter, and without.
struct Formats {
    std::string with, without;
};

Formats random_format(std::mt19937& random) {
    Formats made;
    const auto both = [&made](const std::string& text) { made.with += text, made.without += text; };
    const auto one_of = [&random](std::initializer_list<const char*> words) {
        return std::string(words.begin()[random() % words.size()]);
    };
    both(one_of({"", "a", "%%", "l", "%%ld "}));
    both("%" + one_of({"", "-", "0", "+", " ", "#"}) + one_of({"", "5", "12"}) + one_of({"", ".3", "."}));
    made.with += "l";
    both(one_of({"d", "i", "u", "x", "X", "o"}) + one_of({"", " ", "ld"}));
    return made;
}

TEST(Formats, RandomOnesPrintAsWithoutTheirL) {
    const auto seed = std::random_device{}();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random{seed};
    for (int i = 0; i < 2000; ++i) {
        const Formats made = random_format(random);
        const int value = static_cast<int>(random());
        char narrow_text[80];
        char plain[80];
        qduino_snprintf(narrow_text, sizeof narrow_text, made.with.c_str(), value);
        std::snprintf(plain, sizeof plain, made.without.c_str(), value);
        ASSERT_STREQ(narrow_text, plain) << made.with;
    }
}

}  // namespace
}  // namespace qduino::arduino::formats_test
