#include <OwnReader.h>

void setup() {
  Serial.begin(9600);
  Serial.println(readTable(2));
}

void loop() { delay(1000); }
