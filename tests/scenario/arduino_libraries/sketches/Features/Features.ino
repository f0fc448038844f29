#include <AsksFeatures.h>

AsksFeatures asks;

void setup() {
  Serial.begin(9600);
  SPI.begin();
  Serial.println(asks.transfer(7));
  Serial.println(asks.chunk());
  Serial.println(asks.interruptOf(18));
}

void loop() { delay(1000); }
