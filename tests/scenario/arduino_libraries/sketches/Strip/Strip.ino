#include <Adafruit_NeoPixel.h>

Adafruit_NeoPixel strip(4, 6, NEO_GRB + NEO_KHZ800);

void setup() {
    Serial.begin(9600);
    strip.begin();
    strip.show();
    strip.setBrightness(50);
    for (unsigned i = 0; i < strip.numPixels(); i++) {
        strip.setPixelColor(i, strip.Color(0, 150, 0));
        strip.show();
        delay(20);
    }
    strip.setPixelColor(0, strip.gamma32(strip.ColorHSV(0)));
    strip.show();
    Serial.println(strip.getPixelColor(1), HEX);
}
void loop() { delay(1000); }
