#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "device/ads7828.h"
#include "device/ads7828_chip.h"

namespace qduino::device::ads7828_test {
namespace {

// Copied by hand from the data sheet's channel selection table: C2 C1 C0 for SD = 1.
constexpr std::array<std::uint8_t, 8> kSelectBits{0b000, 0b100, 0b001, 0b101, 0b010, 0b110, 0b011, 0b111};

TEST(Ads7828, CommandByteFollowsTheDataSheetsTable) {
    for (int channel = 0; channel < 8; ++channel) {
        const unsigned expected = 0x80u | unsigned{kSelectBits[static_cast<std::size_t>(channel)]} << 4;
        EXPECT_EQ(ads7828::command_byte(channel), expected) << channel;
    }
}

TEST(Ads7828, DecodesTwelveBitsBigEndianAndIgnoresTheLeadingFour) {
    const std::array<std::uint8_t, 2> bytes{0xFA, 0xBC};
    EXPECT_EQ(ads7828::decode(bytes), 0xABC);
    EXPECT_DOUBLE_EQ(ads7828::fraction(0), 0.5 / 4096);
    EXPECT_DOUBLE_EQ(ads7828::fraction(4095), 4095.5 / 4096);
}

int convert(Ads7828Chip& chip, std::vector<std::uint8_t> out, const std::array<double, 8>& volts) {
    std::array<std::uint8_t, 2> in{};
    chip.transfer(out, in, [&](int channel) { return volts[static_cast<std::size_t>(channel)]; });
    return ads7828::decode(in);
}

TEST(Ads7828Chip, EveryChannelReachesItsOwnInput) {
    Ads7828Chip chip(4.096);
    const std::array<double, 8> volts{0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8};
    for (int channel = 0; channel < 8; ++channel)
        EXPECT_NEAR(convert(chip, {ads7828::command_byte(channel)}, volts), 100 * (channel + 1), 1)
            << channel;
}

TEST(Ads7828Chip, DifferentialPairsSubtractAndSaturateAtZero) {
    Ads7828Chip chip(4.096);
    const std::array<double, 8> volts{1.0, 0.25, 0, 0, 0, 0, 2.0, 3.0};
    EXPECT_NEAR(convert(chip, {0x00}, volts), 750, 1);   // CH0 − CH1
    EXPECT_EQ(convert(chip, {0x40}, volts), 0);          // CH1 − CH0 < 0
    EXPECT_NEAR(convert(chip, {0x70}, volts), 1000, 1);  // CH7 − CH6
}

TEST(Ads7828Chip, PowerDownBitsChooseTheReference) {
    Ads7828Chip chip(3.3);
    const std::array<double, 8> volts{1.25};
    EXPECT_EQ(convert(chip, {ads7828::command_byte(0)}, volts), static_cast<int>(1.25 / 3.3 * 4096));
    EXPECT_EQ(convert(chip, {0x8C}, volts), 2048);  // PD1 PD0 = 11: its own 2.5 V
    EXPECT_EQ(convert(chip, {0x84}, volts), static_cast<int>(1.25 / 3.3 * 4096));  // 01: REF pin
}

TEST(Ads7828Chip, ResultsSaturateAtFullScale) {
    Ads7828Chip chip(3.3);
    const std::array<double, 8> volts{3.3, 9.0, -1.0};
    EXPECT_EQ(convert(chip, {ads7828::command_byte(0)}, volts), 4095);
    EXPECT_EQ(convert(chip, {ads7828::command_byte(1)}, volts), 4095);
    EXPECT_EQ(convert(chip, {ads7828::command_byte(2)}, volts), 0);
}

TEST(Ads7828Chip, AReadAloneRepeatsTheLastCommand) {
    Ads7828Chip chip(4.096);
    const std::array<double, 8> volts{0, 0, 0, 1.5};
    EXPECT_NEAR(convert(chip, {ads7828::command_byte(3)}, volts), 1500, 1);
    EXPECT_NEAR(convert(chip, {}, volts), 1500, 1);
}

TEST(Ads7828Chip, AWriteAloneConvertsNothing) {
    Ads7828Chip chip(4.096);
    const std::array<std::uint8_t, 1> command{ads7828::command_byte(2)};
    int asked = 0;
    chip.transfer(command, {}, [&](int) { return ++asked, 0.0; });
    EXPECT_EQ(asked, 0);
    const std::array<double, 8> volts{0, 0, 2.0};
    EXPECT_NEAR(convert(chip, {}, volts), 2000, 1);
}

}  // namespace
}  // namespace qduino::device::ads7828_test
