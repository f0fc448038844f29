#include "arduino/libraries/FastLED/fastled/math8.h"

// FastLED's documentation gives each piece's begin and slope ("Fast trig functions"). The begins
// are the sine's own; the slopes are in sixteenths, and in 128ths of a piece.

std::uint8_t sin8(std::uint8_t angle) {
    static constexpr std::uint8_t kBegin[] = {0, 49, 90, 117}, kSlope[] = {49, 41, 27, 10};
    const bool falls = (angle & 0x40) != 0;
    const unsigned offset = (falls ? 255u - angle : angle) & 0x3F;
    const unsigned piece = offset / 16, within = offset % 16 + (falls ? 1 : 0);
    const int height = kBegin[piece] + static_cast<int>(kSlope[piece] * within / 16);
    return static_cast<std::uint8_t>(128 + ((angle & 0x80) != 0 ? -height : height));
}

std::int16_t sin16(std::uint16_t angle) {
    static constexpr std::uint16_t kBegin[] = {0, 6393, 12539, 18204, 23170, 27245, 30273, 32137};
    static constexpr std::uint8_t kSlope[] = {49, 48, 44, 38, 31, 23, 14, 4};
    const unsigned rising = (angle & 0x3FFFu) / 8;
    const unsigned offset = (angle & 0x4000) != 0 ? 2047 - rising : rising;
    const unsigned piece = offset / 256, within = offset % 256 / 2;
    const int height = static_cast<int>(kBegin[piece] + kSlope[piece] * within);
    return static_cast<std::int16_t>((angle & 0x8000) != 0 ? -height : height);
}
