#include <in_c.h>

void setup() {
  Serial.begin(9600);
  Serial.println(blink_in_c(13));
}

void loop() { delay(1000); }
