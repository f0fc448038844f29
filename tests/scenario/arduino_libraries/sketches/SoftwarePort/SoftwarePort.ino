#include <SerialGps.h>

SerialGps gps(10, 11);

void setup() {
  Serial.begin(9600);
  gps.begin(9600);
}

void loop() {
  const unsigned long began = micros();
  const bool asked = gps.ask();
  // 13 bytes of 10 bits at 9600 baud are 13.54 ms.
  const unsigned long took = micros() - began;
  Serial.println(asked && took >= 13500 && took < 16000 ? "asked" : "not asked");
  Serial.println(gps.read());
  delay(1000);
}
