#include <FastLED.h>

CRGBArray<8> leds;
CRGB far_strip[3];
CRGBPalette16 palette = PartyColors_p;

DEFINE_GRADIENT_PALETTE(sunset_gp) {0, 120, 0, 0, 128, 255, 104, 0, 255, 0, 0, 255};

void setup() {
    Serial.begin(9600);
    FastLED.addLeds<WS2812B, 6, GRB>(leds, 8).setCorrection(TypicalLEDStrip);
    FastLED.addLeds<NEOPIXEL, 51>(far_strip, 3);
    FastLED.addLeds<APA102, 4, 5, BGR>(leds, 8);
    FastLED.setBrightness(128);
    FastLED.setMaxPowerInVoltsAndMilliamps(5, 2000);
    Serial.println(FastLED.count());
    Serial.println(sin8(64));
    Serial.println(inoise8(1000, 2000, 3000));
    palette = sunset_gp;
    Serial.println(palette[0].r);
}

void loop() {
    static int shown = 0;
    EVERY_N_MILLISECONDS(20) {
        for (int i = 0; i < 4; i++) leds[i] = CHSV(i * 32, 255, 255);
        leds(4, 7) = leds(3, 0);
        fill_solid(far_strip, 3, CRGB::Blue);
        far_strip[1] = blend(CRGB::Red, CRGB::Blue, 128);
        FastLED.show();
        if (++shown == 10) Serial.println(beat8(60) > 0 ? "beats" : "stands");
    }
}
