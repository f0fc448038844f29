#include <BoardPins.h>

void setup() {
  Serial.begin(9600);
  Serial.println(defaultClockPin());
  Serial.println(pinsOfBoard());
}

void loop() { delay(1000); }
