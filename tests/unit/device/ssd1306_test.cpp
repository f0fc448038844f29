// The SSD1306's side of I2C: what is written where, and how it is shown.
#include "device/ssd1306_chip.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace qduino::device::ssd1306_test {
namespace {

using Bytes = std::vector<std::uint8_t>;

void commands(Ssd1306Chip& chip, Bytes bytes) {
    bytes.insert(bytes.begin(), 0x00);
    chip.transfer(bytes, {});
}
void data(Ssd1306Chip& chip, Bytes bytes) {
    bytes.insert(bytes.begin(), 0x40);
    chip.transfer(bytes, {});
}
/// On, mounted as modules are.
Ssd1306Chip shown(int height = 64) {
    Ssd1306Chip chip(height);
    commands(chip, {0xA1, 0xC8, 0xAF});
    return chip;
}
std::vector<std::pair<int, int>> lit_dots(const Ssd1306Chip& chip) {
    std::vector<std::pair<int, int>> dots;
    for (int y = 0; y < chip.height(); ++y)
        for (int x = 0; x < Ssd1306Chip::kWidth; ++x)
            if (chip.lit(x, y)) dots.emplace_back(x, y);
    return dots;
}
using Dots = std::vector<std::pair<int, int>>;

TEST(Ssd1306, AByteIsEightDotsOfAColumn) {
    Ssd1306Chip chip = shown();
    commands(chip, {0xB3, 0x05, 0x12});  // page 3, column 0x25
    data(chip, {0x81, 0x02});
    EXPECT_EQ(lit_dots(chip), (Dots{{0x25, 24}, {0x26, 25}, {0x25, 31}}));
    EXPECT_EQ(chip.data_bytes(), 2u);
}

TEST(Ssd1306, IsDarkUntilItIsSwitchedOnAndSaysSo) {
    Ssd1306Chip chip(64);
    data(chip, Bytes(64, 0xFF));
    EXPECT_TRUE(lit_dots(chip).empty());
    Bytes status(2);
    chip.transfer({}, status);
    EXPECT_EQ(status, (Bytes{0x40, 0x40}));
    commands(chip, {0xAF});
    chip.transfer({}, status);
    EXPECT_EQ(status[0], 0x00);
    EXPECT_EQ(lit_dots(chip).size(), 512u);
    commands(chip, {0xA7});
    EXPECT_EQ(lit_dots(chip).size(), 128u * 64 - 512);
    commands(chip, {0xA5});
    EXPECT_EQ(lit_dots(chip).size(), 128u * 64);
}

/// Where the data sheet's three modes put byte `n`: (column, page).
TEST(Ssd1306, TheThreeModesOfAddressing) {
    for (const int mode : {0, 1, 2}) {
        Ssd1306Chip chip = shown();
        commands(chip, {0x20, static_cast<std::uint8_t>(mode), 0x21, 10, 13, 0x22, 2, 4});
        if (mode == 2) commands(chip, {0xB2, 0x0A, 0x10});
        const int columns = 4, pages = 3;
        Dots expected;
        for (int n = 0; n < 14; ++n) {
            data(chip, {1});
            const int column = mode == 1 ? 10 + n / pages % columns : mode == 0 ? 10 + n % columns : 10 + n;
            const int page = mode == 1 ? 2 + n % pages : mode == 0 ? 2 + n / columns % pages : 2;
            expected.emplace_back(column, 8 * page);
        }
        for (const auto& [x, y] : expected) EXPECT_TRUE(chip.lit(x, y)) << mode << " " << x << " " << y;
        EXPECT_EQ(lit_dots(chip).size(), mode == 2 ? 14u : 12u) << mode;
    }
}

TEST(Ssd1306, ArgumentsMayComeInTransactionsOfTheirOwn) {
    Ssd1306Chip chip = shown();
    // Control bytes with a continuation bit stand before single bytes, and data may follow.
    const Bytes mixed{0x80, 0x20, 0x80, 0x00, 0x80, 0x21, 0x80, 7, 0x80, 8, 0xC0, 0x01, 0x40, 0x80};
    chip.transfer(mixed, {});
    EXPECT_EQ(lit_dots(chip), (Dots{{7, 0}, {8, 7}}));
    commands(chip, {0x21});
    commands(chip, {50});
    commands(chip, {60});
    data(chip, {1});
    EXPECT_TRUE(chip.lit(50, 8)) << "the first page is full";
    EXPECT_EQ(chip.unknown_commands(), 0u);
    commands(chip,
             {0xD5, 0x80, 0xA8, 0x3F, 0x8D, 0x14, 0xDA, 0x12, 0x81, 0xCF, 0xD9, 0xF1, 0xDB, 0x40, 0xE3});
    EXPECT_EQ(chip.unknown_commands(), 0u) << "what libraries begin with";
    commands(chip, {0xFD});
    EXPECT_EQ(chip.unknown_commands(), 1u);
}

TEST(Ssd1306, MountedTheOtherWayRoundIsUpsideDown) {
    for (const int height : {32, 64}) {
        Ssd1306Chip upright = shown(height), turned(height);
        commands(turned, {0xA0, 0xC0, 0xAF});
        std::mt19937 random(1);
        for (int n = 0; n < 128 * height / 8; ++n) {
            if (n % 128 == 0)
                for (Ssd1306Chip* chip : {&upright, &turned})
                    commands(*chip, {static_cast<std::uint8_t>(0xB0 + n / 128), 0x00, 0x10});
            const auto byte = static_cast<std::uint8_t>(random());
            data(upright, {byte});
            data(turned, {byte});
        }
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < 128; ++x) ASSERT_EQ(upright.lit(x, y), turned.lit(127 - x, height - 1 - y));
        commands(upright, {0x45});
        commands(turned, {0xD3, 5});
        for (int x = 0; x < 128; ++x) ASSERT_EQ(upright.lit(x, 0), turned.lit(127 - x, height - 1));
    }
}

}  // namespace
}  // namespace qduino::device::ssd1306_test
