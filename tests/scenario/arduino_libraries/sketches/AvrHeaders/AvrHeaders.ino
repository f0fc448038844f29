#include <AvrHeaders.h>

const char text[] PROGMEM = "123456789";

void setup() {
  Serial.begin(9600);
  Serial.println(checkOf(text), HEX);
  Serial.println(waitABit());
}

void loop() { delay(1000); }
