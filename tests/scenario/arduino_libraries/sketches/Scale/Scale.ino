#include <ClockedScale.h>

ClockedScale scale;

void setup() {
    Serial.begin(9600);
    scale.begin(2, 3);
    Serial.println(scale.read());
    scale.set_scale(-100);
    Serial.println(scale.get_units(4));
    scale.set_gain(32);
    scale.read();  // still of input A; the next is of B
    Serial.println(scale.read());
    scale.power_down();
    delay(10);
    scale.power_up();
    scale.set_gain(128);
    const unsigned long from = millis();
    Serial.println(scale.read());
    Serial.println(millis() - from);
}
void loop() { delay(1000); }
