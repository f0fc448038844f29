// FastLED.h. The sums were recorded from FastLED's own formulas, as its repository has them for
// processors other than the AVR (version 3.10). What strips show is worked out by hand from its
// documentation, and the bytes with a clock from the chips' data sheets.
#include "arduino/libraries/FastLED/lib8tion.h"
#include "tests/unit/arduino/strip_fixture.h"

namespace fastled_test {
namespace {

using ArduinoFastLed = StripTest;

/// Every result counts, and so does its place.
class Sum {
  public:
    void operator()(unsigned value) { sum_ = sum_ * 31 + (value & 0xFFFF); }
    template <typename Color>
    void all(const Color& color) {
        for (const unsigned level : color.raw) (*this)(level);
    }
    [[nodiscard]] std::uint32_t operator()() const { return sum_; }

  private:
    std::uint32_t sum_ = 0;
};

std::uint8_t byte(unsigned value) { return static_cast<std::uint8_t>(value); }

TEST_F(ArduinoFastLed, WavesAreFastLeds) {
    Sum sines, long_sines, eases;
    for (unsigned i = 0; i < 256; ++i) {
        sines(sin8(byte(i)));
        for (const unsigned eased :
             {ease8InOutQuad(byte(i)), ease8InOutCubic(byte(i)), ease8InOutApprox(byte(i))})
            eases(eased);
    }
    for (unsigned i = 0; i < 65536; ++i)
        long_sines(static_cast<std::uint16_t>(sin16(static_cast<std::uint16_t>(i))));
    EXPECT_EQ(sines(), 481775616U);
    EXPECT_EQ(long_sines(), 3187671040U);
    EXPECT_EQ(eases(), 2937489630U);
}

TEST_F(ArduinoFastLed, NoiseIsFastLeds) {
    Sum sum;
    for (std::uint32_t i = 0; i < 20'000; ++i) {
        const std::uint32_t x = i * 7919, y = i * 104'729, z = i * 1'299'709;
        const auto x16 = static_cast<std::uint16_t>(x), y16 = static_cast<std::uint16_t>(y);
        sum(inoise8(x16, y16, static_cast<std::uint16_t>(z)));
        sum(inoise8(x16, y16));
        sum(inoise8(x16));
        sum(inoise16(x * 31, y, z));
        sum(inoise16(x * 31, y));
        sum(inoise16(x * 31));
    }
    EXPECT_EQ(sum(), 3273739293U);
}

TEST_F(ArduinoFastLed, HuesAreFastLeds) {
    Sum sum;
    for (unsigned hue = 0; hue < 256; ++hue) {
        for (unsigned saturation = 0; saturation < 256; saturation += 15) {
            for (unsigned value = 0; value < 256; value += 17) {
                const CHSV color(byte(hue), byte(saturation), byte(value));
                sum.all(CRGB(color));
                CRGB spectrum;
                hsv2rgb_spectrum(color, spectrum);
                sum.all(spectrum);
            }
        }
    }
    EXPECT_EQ(sum(), 3435436669U);
}

TEST_F(ArduinoFastLed, GradientsAndPalettesAreFastLeds) {
    Sum gradients, palettes;
    for (unsigned n = 1; n < 60; ++n) {
        CRGB straight[64];
        fill_gradient_RGB(straight, 0, CRGB(byte(n * 4), 200, 0), static_cast<std::uint16_t>(n),
                          CRGB(10, byte(n * 3), 255));
        for (unsigned i = 0; i <= n; ++i) gradients.all(straight[i]);
        for (const auto way : {FORWARD_HUES, BACKWARD_HUES, SHORTEST_HUES, LONGEST_HUES}) {
            CHSV hues[64];
            fill_gradient(hues, 0, CHSV(byte(n * 4), 200, n % 5 != 0 ? 255 : 0),
                          static_cast<std::uint16_t>(n), CHSV(10, byte(n * 3), 255), way);
            for (unsigned i = 0; i <= n; ++i) gradients.all(hues[i]);
        }
    }
    for (unsigned index = 0; index < 256; ++index) {
        for (unsigned brightness = 0; brightness < 256; brightness += 15)
            palettes.all(ColorFromPalette(PartyColors_p, byte(index), byte(brightness)));
    }
    EXPECT_EQ(gradients(), 3727979177U);
    EXPECT_EQ(palettes(), 1714006812U);
    // A gradient of nine colours in sixteen entries: each colour has one of its own.
    const CRGBPalette16 rainbow(Rainbow_gp);
    EXPECT_EQ(rainbow[0], CRGB::Red);
    EXPECT_EQ(rainbow[6], CRGB(0, 255, 0));
    EXPECT_EQ(rainbow[15], CRGB(171, 0, 85)) << "what is left for the way from pink to red";
    EXPECT_EQ(CRGBPalette256(Rainbow_gp)[160], CRGB::Blue);
}

TEST_F(ArduinoFastLed, ArithmeticStaysInItsRange) {
    EXPECT_EQ(qadd8(200, 100), 255);  // the documentation's example
    EXPECT_EQ(qsub8(10, 20), 0);
    EXPECT_EQ(scale8(128, 255), 128);
    EXPECT_EQ(scale8_video(1, 1), 1);
    EXPECT_EQ(triwave8(128), 254);
    EXPECT_EQ(map8(128, HUE_BLUE, HUE_RED), 208);
    random16_set_seed(1337);
    EXPECT_EQ(random16(), (2053 * 1337 + 13849) % 65536);
    EXPECT_EQ(CRGB(250, 5, 5) + CRGB(10, 0, 250), CRGB(255, 5, 255));
    EXPECT_EQ(CRGB(CRGB::Plaid), CRGB(0xCC5533));
    EXPECT_EQ(blend(CRGB::Black, CRGB::White, 128), CRGB(128, 128, 128));
    CRGBPalette16 now(CRGB::Black);
    nblendPaletteTowardPalette(now, CRGBPalette16(CRGB::White), 4);
    EXPECT_EQ(now[0], CRGB(1, 1, 1));
    EXPECT_EQ(now[1], CRGB(1, 0, 0)) << "four changes are all";
}

TEST_F(ArduinoFastLed, BeatsAndPeriodsFollowTheClock) {
    board().now = qduino::kEpoch + 250ms;  // a quarter of a beat at 60 a minute
    EXPECT_EQ(beat8(60), 64);
    EXPECT_EQ(beatsin8(60, 0, 200), 200);
    int times = 0;
    for (int ms = 0; ms < 100; ++ms) {
        board().now += 1ms;
        EVERY_N_MILLISECONDS(20) { ++times; }
    }
    EXPECT_EQ(times, 4);
}

TEST_F(ArduinoFastLed, SetsArePiecesOfAnArray) {
    CRGBArray<6> pixels;
    pixels.fill_solid(CRGB::Black);
    pixels(0, 2).fill_rainbow(0, 96);
    pixels(3, 5) = pixels(2, 0);  // mirrored
    EXPECT_EQ(pixels[0], pixels[5]);
    EXPECT_EQ(pixels[1], pixels[4]);
    EXPECT_EQ(pixels[2], pixels[3]);
    EXPECT_NE(pixels[0], pixels[1]);
    pixels = CRGB::Black;
    pixels[2] = CRGB(128, 0, 0);
    pixels.blur1d(64);
    EXPECT_EQ(pixels[1].r, 16);
    EXPECT_EQ(pixels[2].r, 96);
    EXPECT_EQ(pixels[3].r, 16);
    int lit = 0;
    for (const CRGB& pixel : pixels(5, 1)) lit += pixel ? 1 : 0;
    EXPECT_EQ(lit, 3);
}

TEST_F(ArduinoFastLed, AStripShowsBrightnessCorrectionAndTemperature) {
    for (const int pin : {6, 51}) {
        wire(pin, 2);
        const std::string before = "ws2812 on pin " + std::to_string(pin) + ": ";
        CRGB pixels[2] = {CRGB(255, 128, 0), CRGB::White};
        qduino::arduino::fastled::ClocklessController strip(pin, GRB, qduino::arduino::kWs2812);
        CFastLED fast;
        CFastLED::addLeds(&strip, pixels, 2);
        fast.show();
        EXPECT_EQ(shown(), before + "1 frames; shows ff8000 ffffff\n");
        fast.setBrightness(128);
        fast.show();
        EXPECT_EQ(shown(), before + "2 frames; shows 804000 808080\n");
        strip.setCorrection(TypicalLEDStrip);
        fast.show(255);
        EXPECT_EQ(shown(), before + "3 frames; shows ff5800 ffb0f0\n");
        CFastLED::setTemperature(Candle);
        fast.show(255);
        EXPECT_EQ(shown(), before + "4 frames; shows ff3300 ff6527\n");
        fast.showColor(CRGB::Red, 255);
        EXPECT_EQ(shown(), before + "5 frames; shows ff0000 ff0000\n");
        EXPECT_EQ(pixels[1], CRGB::White) << "the pixels are as they were";
        fast.clear(true);
        EXPECT_EQ(shown(), before + "6 frames; shows 000000 000000\n");
    }
}

TEST_F(ArduinoFastLed, BrightnessKeepsToThePower) {
    wire(6, 10);
    CRGB pixels[10];
    fill_solid(pixels, 10, CRGB::White);
    qduino::arduino::fastled::ClocklessController strip(6, GRB, qduino::arduino::kWs2812);
    CFastLED fast;
    CFastLED::addLeds(&strip, pixels, 10);
    // 2550 levels at 80, 55 and 75 mW in 256, ten dark pixels, the board.
    EXPECT_EQ(calculate_unscaled_power_mW(pixels, 10), 796U + 547 + 747 + 50);
    EXPECT_EQ(calculate_max_brightness_for_power_mW(255, 5000), 255);
    fast.setMaxPowerInVoltsAndMilliamps(5, 200);
    fast.show();  // 255 · 1000 / 2256 = 113
    EXPECT_NE(shown().find("shows 717171"), std::string::npos) << shown();
}

TEST_F(ArduinoFastLed, DitheringShowsInTheMeanWhatRoundingLoses) {
    CRGB pixels[1] = {CRGB(8, 0, 8)};
    const auto levels_of_eight_frames = [&pixels](const CRGB& scale) {
        std::array<unsigned, 3> sum{};
        for (unsigned frame = 0; frame < 8; ++frame) {
            PixelController sent(pixels, scale, RGB);
            sent.dither(frame);
            sent.for_each(
                [&sum](unsigned r, unsigned g, unsigned b) { sum[0] += r, sum[1] += g, sum[2] += b; });
        }
        return sum;
    };
    const auto levels = levels_of_eight_frames(CRGB(16, 16, 255));
    EXPECT_NEAR(levels[0], 8 * 8 * 17 / 256.0, 1.0);  // each frame alone: 0
    EXPECT_EQ(levels[1], 0U) << "black stays black";
    EXPECT_EQ(levels[2], 64U) << "nothing is rounded";
    // Fewer than 100 frames a second would flicker.
    wire(6, 1);
    qduino::arduino::fastled::ClocklessController strip(6, GRB, qduino::arduino::kWs2812);
    CFastLED fast;
    CFastLED::addLeds(&strip, pixels, 1);
    int lit[2] = {};
    for (int frame = 0; frame < 50; ++frame) {
        fast.show(16);
        lit[frame / 25] += shown().find("shows 000000") == std::string::npos ? 1 : 0;
    }
    EXPECT_EQ(lit[0], 0) << "the rate is not known yet";
    EXPECT_GT(lit[1], 8);
}

/// What a chip with a clock reads: its data at each rise of the clock.
std::vector<unsigned> clocked(const std::vector<qduino::fake::PinEvent>& writes, int data, int clock) {
    std::vector<unsigned> bytes;
    int level = 0, last_clock = 0, bits = 0;
    for (const auto& write : writes) {
        if (write.pin == data) level = write.level;
        if (write.pin == clock && write.level == 1 && last_clock == 0) {
            if (bits++ % 8 == 0) bytes.push_back(0);
            bytes.back() = bytes.back() << 1 | static_cast<unsigned>(level);
        }
        if (write.pin == clock) last_clock = write.level;
    }
    return bytes;
}

TEST_F(ArduinoFastLed, ALampOfThreePinsShowsTheFirstPixel) {
    CRGB pixels[2] = {CRGB(255, 128, 0), CRGB::Blue};
    CFastLED fast;
    CLEDController& lamp = CFastLED::addLeds<ANALOG_RGB, 5, 6, 3>(pixels, 2);
    lamp.setDither(DISABLE_DITHER);
    EXPECT_EQ(board().modes[6], qduino::board::PinMode::output);
    const auto last_levels = [] {
        std::map<int, int> levels;
        for (const auto& event : board().pwm) levels[event.pin] = static_cast<int>(event.duty * 255 + 0.5);
        return levels;
    };
    fast.show();
    EXPECT_EQ(last_levels(), (std::map<int, int>{{5, 255}, {6, 128}, {3, 0}}));
    lamp.setCorrection(TypicalLEDStrip);
    fast.show(128);
    EXPECT_EQ(last_levels(), (std::map<int, int>{{5, 128}, {6, 44}, {3, 0}}));
    lamp.setLeds(pixels, 0);
    fast.show();
    EXPECT_EQ(last_levels(), (std::map<int, int>{{5, 0}, {6, 0}, {3, 0}}));
    lamp.setLeds(nullptr, 0);
}

TEST_F(ArduinoFastLed, ChipsWithAClockGetTheirFrames) {
    const struct {
        ESPIChipsets chip;
        EOrder order;
        std::vector<unsigned> frame;
    } cases[] = {
        {APA102, BGR, {0, 0, 0, 0, 0xFF, 0x33, 0x22, 0x11, 0xFF, 0, 0, 0xFF, 0, 0, 0, 0, 0}},
        {WS2801, RGB, {0x11, 0x22, 0x33, 0xFF, 0, 0}},
        {LPD8806, GRB, {0x91, 0x89, 0x9A, 0x80, 0xFF, 0x80, 0}},
        {P9813, RGB, {0, 0, 0, 0, 0xFF, 0x33, 0x22, 0x11, 0xFC, 0, 0, 0xFF, 0, 0, 0, 0}},
    };
    for (const auto& wanted : cases) {
        CRGB pixels[2] = {CRGB(0x112233), CRGB::Red};
        std::vector<unsigned> on_bus;
        board().spi_device = [&on_bus](auto, std::span<std::uint8_t> data) {
            on_bus.assign(data.begin(), data.end());
        };
        for (const auto& [data, clock] : {std::pair{4, 5}, std::pair{51, 52}}) {
            qduino::arduino::fastled::ClockedController strip(wanted.chip, data, clock, wanted.order, 0);
            strip.init();
            strip.setLeds(pixels, 2);
            board().writes.clear();
            strip.showLeds();
            EXPECT_EQ(data == 51 ? on_bus : clocked(board().writes, data, clock), wanted.frame)
                << wanted.chip;
        }
    }
}

}  // namespace
}  // namespace fastled_test
