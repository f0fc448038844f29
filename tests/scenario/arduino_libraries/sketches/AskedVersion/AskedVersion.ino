#include <AskedVersion.h>

AskedVersion asked;

void setup() {
  Serial.begin(9600);
  delay(25);
  Serial.println(asked.now());
}

void loop() { delay(1000); }
