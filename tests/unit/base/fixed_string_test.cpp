#include "base/fixed_string.h"

#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <string>
#include <type_traits>

namespace qduino::fixed_string_test {
namespace {

static_assert(std::is_trivially_copyable_v<FixedString<16>>);
static_assert(FixedString<4>{"abc"}.size() == 3);

TEST(FixedString, WhatDoesNotFitIsCut) {
    FixedString<5> text{"abc"};
    text.append("defg");
    EXPECT_EQ(text, "abcde");
    text.push_back('x');
    EXPECT_EQ(text.size(), 5u);
    text.assign("z");
    EXPECT_EQ(text, "z");
    text.clear();
    EXPECT_TRUE(text.empty());
}

TEST(FixedString, AgreesWithAStdStringThatIsCut) {
    std::mt19937_64 random{7};
    FixedString<23> text;
    std::string oracle;
    for (int i = 0; i < 20'000; ++i) {
        const std::string piece(random() % 12, static_cast<char>('a' + random() % 26));
        switch (random() % 4) {
            case 0:
                text.assign(piece);
                oracle = piece;
                break;
            case 1:
                text.push_back('!');
                oracle.push_back('!');
                break;
            default:
                text.append(piece);
                oracle += piece;
        }
        oracle.resize(std::min<std::size_t>(oracle.size(), 23));
        ASSERT_EQ(text.view(), oracle);
    }
}

TEST(FixedString, ADamagedLengthReadsAndWritesInsideItsBytes) {
    struct Guarded {
        FixedString<8> text{"abc"};
        char after[8] = {'G', 'G', 'G', 'G', 'G', 'G', 'G', 'G'};
    } guarded;
    const std::uint32_t damaged = 1'000'000;
    // The length comes first.
    std::memcpy(static_cast<void*>(&guarded.text), &damaged, sizeof damaged);
    EXPECT_EQ(guarded.text.size(), 8u);
    EXPECT_EQ(guarded.text.view().size(), 8u);
    guarded.text.append("overflow");
    EXPECT_EQ(guarded.text.size(), 8u);
    EXPECT_EQ(std::string(guarded.after, 8), "GGGGGGGG");
}

}  // namespace
}  // namespace qduino::fixed_string_test
