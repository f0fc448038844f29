// A strip of WS2812, against pulses made by the data sheet's figure.
#include "device/ws2812_chip.h"

#include <gtest/gtest.h>

#include <random>

namespace qduino::device::ws2812_test {
namespace {

class Ws2812 : public testing::Test {
  protected:
    void pulse(Ws2812Chip& strip, Nanoseconds high, Nanoseconds low) {
        strip.data(now_, true);
        now_ += high;
        strip.data(now_, false);
        now_ += low;
    }
    /// Each byte from its highest bit on.
    void send(Ws2812Chip& strip, std::initializer_list<unsigned> bytes) {
        for (const unsigned byte : bytes)
            for (unsigned mask = 0x80; mask != 0; mask >>= 1)
                pulse(strip, (byte & mask) != 0 ? 800ns : 400ns, (byte & mask) != 0 ? 450ns : 850ns);
    }
    Instant now_ = kEpoch;
};

TEST_F(Ws2812, GreenRedBlueForOnePixelAfterTheOther) {
    Ws2812Chip strip(2);
    send(strip, {0x12, 0x34, 0x56, 0xFF, 0x00, 0x81, 9, 9, 9});
    strip.settle(now_);
    EXPECT_EQ(strip.shown(), (std::vector<std::uint32_t>{0, 0})) << "not before the line was low";
    now_ += 50us;
    strip.settle(now_);
    EXPECT_EQ(strip.shown(), (std::vector<std::uint32_t>{0x341256, 0x00FF81}));
    EXPECT_EQ(strip.frames(), 1u);
    EXPECT_EQ(strip.unclear(), 0u);
    send(strip, {1, 2, 3});
    now_ += 1ms;
    send(strip, {4, 5, 6});  // the pause latched the frame before
    EXPECT_EQ(strip.shown(), (std::vector<std::uint32_t>{0x020103, 0x00FF81}));
    EXPECT_EQ(strip.frames(), 2u);
}

TEST_F(Ws2812, SaysWhatIsNeitherAZeroNorAOne) {
    Ws2812Chip strip(1);
    for (const Nanoseconds high : {240ns, 560ns, 640ns, 960ns, 5000ns}) pulse(strip, high, 450ns);
    EXPECT_EQ(strip.unclear(), 5u);
    for (const Nanoseconds high : {250ns, 550ns, 650ns, 950ns}) pulse(strip, high, 450ns);
    EXPECT_EQ(strip.unclear(), 5u);
    now_ += 50us;
    strip.settle(now_);
    EXPECT_EQ(strip.unclear(), 6u) << "nine bits are no pixel";
    EXPECT_EQ(strip.shown().front(), 0u);
}

}  // namespace
}  // namespace qduino::device::ws2812_test
