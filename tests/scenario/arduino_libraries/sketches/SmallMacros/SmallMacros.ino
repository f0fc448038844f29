#include <SmallMacros.h>

SmallMacros small;

void setup() {
  Serial.begin(9600);
  small.say();
}

void loop() { delay(1000); }
