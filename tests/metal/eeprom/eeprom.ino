// Says what the EEPROM holds at first, and after it has been written.
#include <EEPROM.h>

void setup() {
  Serial.begin(115200);
  long kept = 0;
  Serial.println(EEPROM.get(7, kept));
  EEPROM.put(7, 1234L);
  EEPROM.commit();
  Serial.println(EEPROM.get(7, kept));
}

void loop() {}
