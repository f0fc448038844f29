// FastLED's controllers: one for each strip. It knows the pixels, and sends them as its chips want
// them, as bright, as white and as corrected as it is told.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "arduino/libraries/FastLED/fastled/colors.h"
#include "arduino/libraries/NeoPixel/pixel_wave.h"

/// Which level is sent first, second, third: an octal digit each.
enum EOrder : std::uint16_t { RGB = 0012, RBG = 0021, GRB = 0102, GBR = 0120, BRG = 0201, BGR = 0210 };

using EDitherMode = std::uint8_t;
#define DISABLE_DITHER 0x00
#define BINARY_DITHER 0x01

/// Chips with a clock wire.
enum ESPIChipsets : std::uint8_t { LPD8806, WS2801, WS2803, P9813, APA102, SK9822, DOTSTAR };

/// Pixels on their way to a strip: scaled, dithered and in the strip's order.
class PixelController {
  public:
    PixelController(std::span<const CRGB> pixels, const CRGB& scale, EOrder order);
    /// Levels that scaling rounds away appear in some frames and not in others (FastLED's binary
    /// dithering, of three bits): `frame` counts them.
    void dither(unsigned frame);
    /// Calls send(first, second, third) for each pixel.
    template <typename Send>
    void for_each(Send send) {
        const int place[] = {order_ >> 6 & 3, order_ >> 3 & 3, order_ & 3};
        for (const CRGB& pixel : pixels_) {
            const CRGB levels = next(pixel);
            send(levels.raw[place[0]], levels.raw[place[1]], levels.raw[place[2]]);
        }
    }
    [[nodiscard]] std::size_t size() const { return pixels_.size(); }

  private:
    CRGB next(const CRGB& pixel);

    std::span<const CRGB> pixels_;
    CRGB scale_;
    EOrder order_;
    CRGB more_{0, 0, 0}, turn_{0, 0, 0};  // added to a pixel; what the next one gets is turn - more
};

class CLEDController {
  public:
    CLEDController() = default;
    CLEDController(const CLEDController&) = delete;
    CLEDController& operator=(const CLEDController&) = delete;
    virtual ~CLEDController();

    /// Setup-time: the pins are ready to send.
    virtual void init() = 0;
    /// How many frames a second its chips can show.
    [[nodiscard]] virtual std::uint16_t getMaxRefreshRate() const { return 0; }

    /// Setup-time.
    CLEDController& setLeds(CRGB* pixels, int count);
    void showLeds(std::uint8_t brightness = 255);
    /// The whole strip in one colour; the pixels stay as they are.
    void showColor(const CRGB& color, std::uint8_t brightness = 255);
    /// All black, and shown so.
    void clearLeds();
    void clearLedData();
    [[nodiscard]] CRGB* leds() const { return pixels_.data(); }
    [[nodiscard]] int size() const { return static_cast<int>(pixels_.size()); }
    CRGB& operator[](int i) const { return pixels_[static_cast<std::size_t>(i)]; }

    CLEDController& setCorrection(const CRGB& correction) { return correction_ = correction, *this; }
    CLEDController& setTemperature(const CRGB& temperature) { return temperature_ = temperature, *this; }
    CLEDController& setDither(EDitherMode mode = BINARY_DITHER) { return dither_ = mode, *this; }
    [[nodiscard]] CRGB getCorrection() const { return correction_; }
    [[nodiscard]] CRGB getTemperature() const { return temperature_; }
    [[nodiscard]] EDitherMode getDither() const { return dither_; }
    /// What each level is scaled by: brightness, correction and temperature together.
    [[nodiscard]] CRGB getAdjustment(std::uint8_t brightness) const;

    static CLEDController* head() { return first_; }
    [[nodiscard]] CLEDController* next() const { return next_; }
    /// Setup-time: one of the program's strips from now on, behind the others.
    void enlist();

  protected:
    /// Setup-time: room for so many.
    virtual void resize(int count) = 0;
    virtual void send(PixelController& pixels) = 0;
    [[nodiscard]] virtual EOrder order() const = 0;

  private:
    void show(std::span<const CRGB> pixels, std::uint8_t brightness);

    std::span<CRGB> pixels_;
    std::vector<CRGB> one_color_;  // as long as the strip
    CRGB correction_ = UncorrectedColor, temperature_ = UncorrectedTemperature;
    EDitherMode dither_ = BINARY_DITHER;
    unsigned frame_ = 0;
    CLEDController* next_ = nullptr;
    static CLEDController* first_;
};

namespace qduino::arduino::fastled {

/// Strips with one wire.
class ClocklessController : public CLEDController {
  public:
    ClocklessController(int pin, EOrder order, const PixelTiming& timing)
        : pin_(pin), order_(order), timing_(timing) {}
    void init() override { PixelWave::begin(pin_); }
    [[nodiscard]] std::uint16_t getMaxRefreshRate() const override { return 400; }

  protected:
    void resize(int count) override { wave_.resize(static_cast<std::size_t>(3 * count)); }
    void send(PixelController& pixels) override;
    [[nodiscard]] EOrder order() const override { return order_; }

  private:
    int pin_;
    EOrder order_;
    PixelTiming timing_;
    PixelWave wave_;
};

/// Strips with a clock. On pins 51 and 52 (MOSI, SCK) they are on SPI; on others the calling loop
/// makes each edge.
class ClockedController : public CLEDController {
  public:
    /// `clock_hz`: 0 is what the chip likes.
    ClockedController(ESPIChipsets chip, int data, int clock, EOrder order, std::uint32_t clock_hz);
    void init() override;

  protected:
    void resize(int count) override;
    void send(PixelController& pixels) override;
    [[nodiscard]] EOrder order() const override { return order_; }

  private:
    void put(std::initializer_list<std::uint8_t> bytes);
    void put_pixel(std::uint8_t a, std::uint8_t b, std::uint8_t c);
    void transmit();

    ESPIChipsets chip_;
    int data_, clock_;
    EOrder order_;
    std::uint32_t clock_hz_;
    std::vector<std::uint8_t> frame_;  // as it is sent
    std::size_t used_ = 0;
    Instant ready_{};  // when the strip shows the last ones
};

/// One lamp of three colours, each on a pin with PWM: the first pixel.
class AnalogController : public CLEDController {
  public:
    AnalogController(int red, int green, int blue) : pins_{red, green, blue} {}
    void init() override;

  protected:
    void resize(int) override {}
    void send(PixelController& pixels) override;
    [[nodiscard]] EOrder order() const override { return RGB; }

  private:
    int pins_[3];
};

// Data sheets: WS2811 in its fast mode, SK6812, TM1809; UCS1903 at half the speed.
inline constexpr PixelTiming kWs2811{Nanoseconds{1250}, Nanoseconds{250}, Nanoseconds{600}, kPixelLatch};
inline constexpr PixelTiming kSk6812{Nanoseconds{1250}, Nanoseconds{300}, Nanoseconds{600}, kPixelLatch};
inline constexpr PixelTiming kTm1809{Nanoseconds{1250}, Nanoseconds{350}, Nanoseconds{700}, kPixelLatch};
inline constexpr PixelTiming kUcs1903{Nanoseconds{2500}, Nanoseconds{500}, Nanoseconds{2000}, kPixelLatch};

}  // namespace qduino::arduino::fastled

#define QDUINO_CLOCKLESS_(name, timing)                                 \
    template <std::uint8_t DataPin, EOrder Order>                       \
    class name : public qduino::arduino::fastled::ClocklessController { \
      public:                                                           \
        name() : ClocklessController(DataPin, Order, timing) {}         \
    }
QDUINO_CLOCKLESS_(WS2812, qduino::arduino::kWs2812);
QDUINO_CLOCKLESS_(WS2812B, qduino::arduino::kWs2812);
QDUINO_CLOCKLESS_(WS2813, qduino::arduino::kWs2812);
QDUINO_CLOCKLESS_(WS2815, qduino::arduino::kWs2812);
QDUINO_CLOCKLESS_(WS2852, qduino::arduino::kWs2812);
QDUINO_CLOCKLESS_(WS2811, qduino::arduino::fastled::kWs2811);
QDUINO_CLOCKLESS_(WS2811_400, qduino::arduino::kWs2811Slow);
QDUINO_CLOCKLESS_(APA104, qduino::arduino::fastled::kWs2811);
QDUINO_CLOCKLESS_(APA106, qduino::arduino::fastled::kWs2811);
QDUINO_CLOCKLESS_(PL9823, qduino::arduino::fastled::kWs2811);
QDUINO_CLOCKLESS_(SK6812, qduino::arduino::fastled::kSk6812);
QDUINO_CLOCKLESS_(SK6822, qduino::arduino::fastled::kSk6812);
QDUINO_CLOCKLESS_(TM1809, qduino::arduino::fastled::kTm1809);
QDUINO_CLOCKLESS_(TM1804, qduino::arduino::fastled::kTm1809);
QDUINO_CLOCKLESS_(UCS1903, qduino::arduino::fastled::kUcs1903);
QDUINO_CLOCKLESS_(UCS1903B, qduino::arduino::kWs2812);
QDUINO_CLOCKLESS_(UCS1904, qduino::arduino::kWs2812);
#undef QDUINO_CLOCKLESS_

/// Adafruit's name for a WS2812B, whose green is first.
template <std::uint8_t DataPin>
class NEOPIXEL : public WS2812B<DataPin, GRB> {};

/// An LED without a chip.
template <std::uint8_t RedPin, std::uint8_t GreenPin, std::uint8_t BluePin>
class ANALOG_RGB : public qduino::arduino::fastled::AnalogController {
  public:
    ANALOG_RGB() : AnalogController(RedPin, GreenPin, BluePin) {}
};
