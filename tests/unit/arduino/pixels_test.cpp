// Adafruit_NeoPixel, against a strip that reads pulses as the chip does (device/ws2812_chip.h).
#include "arduino/libraries/NeoPixel/Adafruit_NeoPixel.h"
#include "tests/unit/arduino/strip_fixture.h"

namespace pixels_test {
namespace {

using ArduinoPixels = StripTest;

TEST_F(ArduinoPixels, EachPixelHasItsColourByPinAndBySpi) {
    for (const int pin : {6, 51}) {
        wire(pin, 3);
        Adafruit_NeoPixel strip(3, static_cast<std::int16_t>(pin), NEO_GRB + NEO_KHZ800);
        strip.begin();
        strip.setPixelColor(0, 0x123456);
        strip.setPixelColor(2, 255, 0, 1);
        strip.setPixelColor(3, 0xFFFFFF);  // there is none
        strip.show();
        EXPECT_FALSE(strip.canShow());
        EXPECT_EQ(shown(),
                  "ws2812 on pin " + std::to_string(pin) + ": 1 frames; shows 123456 000000 ff0001\n");
        strip.setPixelColor(1, strip.getPixelColor(0));
        strip.setBrightness(127);
        strip.show();  // waits until the first is shown
        EXPECT_EQ(shown(),
                  "ws2812 on pin " + std::to_string(pin) + ": 2 frames; shows 091a2b 091a2b 7f0000\n");
        EXPECT_EQ(strip.getPixelColor(2), 0xFF0001U) << "as it was set";
        strip.clear();
        strip.fill(0x0000FF, 1, 1);
        strip.setBrightness(255);
        strip.show();
        EXPECT_EQ(shown(),
                  "ws2812 on pin " + std::to_string(pin) + ": 3 frames; shows 000000 0000ff 000000\n");
    }
}

TEST_F(ArduinoPixels, ABitLasts1250Nanoseconds) {
    Adafruit_NeoPixel strip(1, 6);
    strip.begin();
    strip.setPixelColor(0, 0x00FF00);  // green comes first
    board().writes.clear();
    strip.show();
    ASSERT_EQ(board().writes.size(), 48U);
    const std::int64_t from = board().writes.front().at_ns;
    for (std::size_t i = 0; i < 48; ++i) {
        const std::int64_t high = i < 16 ? 800 : 400;
        EXPECT_EQ(board().writes[i].level, i % 2 == 0 ? 1 : 0);
        EXPECT_EQ(board().writes[i].at_ns - from,
                  static_cast<std::int64_t>(i / 2) * 1250 + (i % 2 == 0 ? 0 : high));
    }
}

TEST_F(ArduinoPixels, OtherOrdersAndWhite) {
    wire(6, 4);
    Adafruit_NeoPixel four_bytes(3, 6, NEO_RGBW);  // twelve bytes are four pixels of the strip
    four_bytes.begin();
    four_bytes.setPixelColor(0, 0x11, 0x22, 0x33, 0x44);
    four_bytes.setPixelColor(2, 0x55, 0x66, 0x77, 0x88);
    four_bytes.show();
    EXPECT_EQ(shown(), "ws2812 on pin 6: 1 frames; shows 221133 004400 000055 776688\n");
    Adafruit_NeoPixel other(1, 6, NEO_BRG);
    other.setPixelColor(0, 0x112233);
    board().now += 1ms;
    other.show();
    EXPECT_NE(shown().find("2 frames; shows 113322 "), std::string::npos);
}

/// A bus of the fake board takes no time; the strip does.
TEST_F(ArduinoPixels, TheNextFrameWaitsForAllBitsOfThisOneBySpi) {
    for (const auto& [type, bit_ns] : {std::pair{NEO_GRB + NEO_KHZ800, 1250}, {NEO_GRB + NEO_KHZ400, 2500}}) {
        Adafruit_NeoPixel strip(5, MOSI, static_cast<neoPixelType>(type));
        strip.begin();
        const qduino::Instant from = board().now;
        strip.show();
        const qduino::Nanoseconds bits{bit_ns * 5 * 24};
        board().now = from + bits + 299us;
        EXPECT_FALSE(strip.canShow());
        board().now = from + bits + 301us;
        EXPECT_TRUE(strip.canShow());
    }
}

TEST_F(ArduinoPixels, AStripOfAnotherLengthIsDarkAndWhole) {
    wire(6, 4);
    Adafruit_NeoPixel strip(2, 6);
    strip.begin();
    strip.fill(0x010203);
    strip.updateLength(4);
    EXPECT_EQ(strip.numPixels(), 4);
    strip.setPixelColor(3, 0x405060);
    strip.show();
    EXPECT_EQ(shown(), "ws2812 on pin 6: 1 frames; shows 000000 000000 000000 405060\n");
    strip.updateLength(1);
    strip.setPixelColor(1, 0xFFFFFF);
    board().now += 1ms;
    strip.show();
    EXPECT_EQ(shown(), "ws2812 on pin 6: 2 frames; shows 000000 000000 000000 405060\n");
}

TEST_F(ArduinoPixels, ARainbowGoesRoundTheStrip) {
    Adafruit_NeoPixel strip(3, 6);
    strip.rainbow(0, 1, 255, 255, false);
    for (std::uint16_t i = 0; i < 3; ++i)
        EXPECT_EQ(strip.getPixelColor(i),
                  Adafruit_NeoPixel::ColorHSV(static_cast<std::uint16_t>(i * 65536 / 3)));
    strip.rainbow(65000, -2, 200, 100);
    EXPECT_EQ(strip.getPixelColor(1), Adafruit_NeoPixel::gamma32(Adafruit_NeoPixel::ColorHSV(
                                          static_cast<std::uint16_t>(65000 - 2 * 65536 / 3), 200, 100)));
    EXPECT_EQ(Adafruit_NeoPixel::sine8(0), 128);
    EXPECT_EQ(Adafruit_NeoPixel::sine8(64), 255);
    EXPECT_EQ(Adafruit_NeoPixel::sine8(192), 0);
}

TEST_F(ArduinoPixels, ColoursOfTheCircle) {
    EXPECT_EQ(Adafruit_NeoPixel::ColorHSV(0), 0xFF0000U);
    EXPECT_EQ(Adafruit_NeoPixel::ColorHSV(65536 / 6), 0xFFFE00U);
    EXPECT_EQ(Adafruit_NeoPixel::ColorHSV(65536 / 3), 0x00FF00U);
    EXPECT_EQ(Adafruit_NeoPixel::ColorHSV(2 * 65536 / 3), 0x0000FFU);
    EXPECT_EQ(Adafruit_NeoPixel::ColorHSV(40000, 0, 100), 0x646464U) << "no saturation: grey";
    EXPECT_EQ(Adafruit_NeoPixel::gamma32(0xFF800001), 0xFF2A0000U);  // 255 (128/255)^2.6 = 42.5
}

}  // namespace
}  // namespace pixels_test
