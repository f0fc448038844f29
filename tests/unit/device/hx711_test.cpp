// The HX711's side of its wire, against a reader that follows the data sheet's timing diagram.
#include "device/hx711_chip.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace qduino::device::hx711_test {
namespace {

class Hx711 : public testing::Test {
  protected:
    /// `pulses` clock pulses of 1 µs up and 1 µs down. Returns the first 24 bits.
    std::uint32_t shift(Hx711Chip& chip, int pulses) {
        std::uint32_t bits = 0;
        for (int i = 0; i < pulses; ++i) {
            chip.clock(now_, true);
            now_ += 1us;
            if (i < 24) bits = bits << 1 | (chip.data(now_) ? 1u : 0u);
            chip.clock(now_, false);
            now_ += 1us;
        }
        return bits;
    }
    /// Waits for a result and reads it, as a signed number.
    std::int32_t read(Hx711Chip& chip, int pulses = 25) {
        while (chip.data(now_)) now_ += 100us;
        // Two's complement of 24 bits, by its definition.
        const auto bits = static_cast<std::int32_t>(shift(chip, pulses));
        return bits >= 0x80'0000 ? bits - 0x100'0000 : bits;
    }
    Instant now_ = kEpoch;
};

TEST_F(Hx711, ReadsEveryNumberOf24Bits) {
    std::mt19937 random(5);
    std::vector<std::int32_t> values{0, 1, -1, 8'388'607, -8'388'608, 0x55'5555, -0x2A'AAAB};
    for (int i = 0; i < 100; ++i)
        values.push_back(static_cast<std::int32_t>(random() % 0x100'0000) - 0x80'0000);
    for (const std::int32_t value : values) {
        Hx711Chip chip(value);
        now_ = kEpoch;
        EXPECT_EQ(read(chip), value);
        EXPECT_EQ(read(chip), value);
        EXPECT_EQ(chip.results(), 2u);
    }
}

TEST_F(Hx711, SaturatesBeyond24Bits) {
    Hx711Chip high(9'000'000), low(-9'000'000);
    EXPECT_EQ(read(high), 0x7F'FFFF);
    now_ = kEpoch;
    EXPECT_EQ(read(low), -0x80'0000);
}

TEST_F(Hx711, SaysWhenAResultIsReady) {
    Hx711Chip chip(5);
    EXPECT_TRUE(chip.data(kEpoch + 399ms));
    EXPECT_FALSE(chip.data(kEpoch + 400ms));
    read(chip);
    const Instant read_at = now_;
    EXPECT_TRUE(chip.data(read_at)) << "the 25th pulse pulls it high";
    EXPECT_TRUE(chip.data(read_at + 99ms));
    EXPECT_FALSE(chip.data(read_at + 100ms));
}

TEST_F(Hx711, PulsesBeforeAResultMeanNothing) {
    Hx711Chip chip(-7);
    now_ = kEpoch + 1ms;
    shift(chip, 30);
    EXPECT_EQ(read(chip), -7);
    EXPECT_EQ(chip.results(), 1u);
}

TEST_F(Hx711, TheLastPulsesChooseTheNextInput) {
    Hx711Chip chip(1000, -30);
    EXPECT_EQ(read(chip, 27), 1000);
    EXPECT_EQ(chip.input(), Hx711Input::a_64);
    EXPECT_TRUE(chip.data(now_ + 300ms)) << "a new input settles for four conversions";
    EXPECT_EQ(read(chip, 26), 500);
    EXPECT_EQ(read(chip, 25), -30);
    EXPECT_EQ(read(chip, 25), 1000);
}

TEST_F(Hx711, ALongPulseSwitchesItOffAndItBeginsAnew) {
    Hx711Chip chip(42, 7);
    read(chip, 26);
    chip.clock(now_, true);
    EXPECT_TRUE(chip.data(now_ + 60us));
    now_ += 1s;
    chip.clock(now_, false);
    EXPECT_EQ(chip.power_downs(), 1u);
    EXPECT_TRUE(chip.data(now_ + 399ms));
    EXPECT_EQ(read(chip), 42) << "input A again";
}

}  // namespace
}  // namespace qduino::device::hx711_test
