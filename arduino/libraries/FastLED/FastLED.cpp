#include "arduino/libraries/FastLED/FastLED.h"

#include <algorithm>

#include "board/board.h"

namespace board = qduino::board;
using qduino::Instant;
using qduino::Nanoseconds;

CFastLED FastLED QDUINO_BEFORE_SKETCH;

namespace {

constexpr std::uint32_t kBoardMilliwatts = 125, kDarkMilliwatts = 5;
std::uint8_t limit_pin = 0;

template <typename Do>
void for_each_strip(Do what) {
    for (CLEDController* strip = CLEDController::head(); strip != nullptr; strip = strip->next())
        what(*strip);
}

}  // namespace

std::uint32_t calculate_unscaled_power_mW(const CRGB* pixels, std::uint16_t count) {
    static constexpr std::uint32_t kMilliwatts[] = {80, 55, 75};  // of a level of 256
    std::uint32_t levels[3] = {}, sum = kDarkMilliwatts * count;
    for (const CRGB& pixel : std::span(pixels, count)) {
        for (int i = 0; i < 3; ++i) levels[i] += pixel.raw[i];
    }
    for (int i = 0; i < 3; ++i) sum += levels[i] * kMilliwatts[i] >> 8;
    return sum;
}

std::uint8_t calculate_max_brightness_for_power_mW(std::uint8_t brightness, std::uint32_t milliwatts) {
    std::uint32_t whole = kBoardMilliwatts;
    for_each_strip([&whole](const CLEDController& strip) {
        whole += calculate_unscaled_power_mW(strip.leds(), static_cast<std::uint16_t>(strip.size()));
    });
    const std::uint32_t wanted = whole * brightness / 256;
    const bool limited = wanted >= milliwatts;
    if (limit_pin != 0) digitalWrite(limit_pin, limited ? HIGH : LOW);
    return limited && wanted != 0 ? static_cast<std::uint8_t>(brightness * milliwatts / wanted) : brightness;
}

void set_max_power_indicator_LED(std::uint8_t pin) {
    limit_pin = pin;
    if (pin != 0) pinMode(pin, OUTPUT);
}

CLEDController& CFastLED::addLeds(CLEDController* strip, CRGB* pixels, int count_or_offset, int length) {
    const int offset = length > 0 ? count_or_offset : 0;
    strip->enlist();
    strip->init();
    strip->setLeds(pixels + offset, length > 0 ? length : count_or_offset);
    if (strip->getMaxRefreshRate() != 0) FastLED.setMaxRefreshRate(strip->getMaxRefreshRate(), true);
    return *strip;
}

template <typename Show>
void CFastLED::show_each(std::uint8_t brightness, Show show_one) {
    qduino::arduino::wait_until(last_frame_ + least_interval_);
    last_frame_ = board::current().now();
    if (most_milliwatts_ != 0)
        brightness = calculate_max_brightness_for_power_mW(brightness, most_milliwatts_);
    for_each_strip([&](CLEDController& strip) {
        const EDitherMode mode = strip.getDither();
        if (frames_per_second_ < 100) strip.setDither(DISABLE_DITHER);
        show_one(strip, brightness);
        strip.setDither(mode);
    });
    countFPS();
}

void CFastLED::show(std::uint8_t brightness) {
    show_each(brightness, [](CLEDController& strip, std::uint8_t as_bright) { strip.showLeds(as_bright); });
}

void CFastLED::showColor(const CRGB& color, std::uint8_t brightness) {
    show_each(brightness,
              [&color](CLEDController& strip, std::uint8_t as_bright) { strip.showColor(color, as_bright); });
}

void CFastLED::clear(bool shown) {
    for_each_strip([](CLEDController& strip) { strip.clearLedData(); });
    if (shown) showColor(CRGB(0, 0, 0), 0);
}

void CFastLED::delay(unsigned long ms) {
    const Instant until = board::current().now() + Nanoseconds{1'000'000} * static_cast<std::int64_t>(ms);
    do {
        ::delay(1);
        show();
    } while (board::current().now() < until);
}

void CFastLED::setCorrection(const CRGB& correction) {
    for_each_strip([&](CLEDController& strip) { strip.setCorrection(correction); });
}

void CFastLED::setTemperature(const CRGB& temperature) {
    for_each_strip([&](CLEDController& strip) { strip.setTemperature(temperature); });
}

void CFastLED::setDither(EDitherMode mode) {
    for_each_strip([&](CLEDController& strip) { strip.setDither(mode); });
}

void CFastLED::setMaxRefreshRate(std::uint16_t per_second, bool constrain) {
    const Nanoseconds interval{per_second == 0 ? 0 : 1'000'000'000 / per_second};
    least_interval_ = constrain ? std::max(least_interval_, interval) : interval;
}

void CFastLED::countFPS(int frames) {
    if (++counted_ < frames) return;
    const Instant now = board::current().now();
    const std::int64_t passed_ms = std::max<std::int64_t>((now - counted_from_).count() / 1'000'000, 1);
    frames_per_second_ = static_cast<std::uint16_t>(counted_ * std::int64_t{1000} / passed_ms);
    counted_ = 0;
    counted_from_ = now;
}

int CFastLED::count() {
    int strips = 0;
    for_each_strip([&strips](const CLEDController&) { ++strips; });
    return strips;
}

CLEDController& CFastLED::operator[](int strip) const {
    CLEDController* at = CLEDController::head();
    while (strip-- > 0 && at->next() != nullptr) at = at->next();
    return *at;
}

int CFastLED::size() { return FastLED[0].size(); }
CRGB* CFastLED::leds() { return FastLED[0].leds(); }
