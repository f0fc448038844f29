#include "in_c.h"

#include <Arduino.h>
#include <avr/pgmspace.h>
#include <util/delay.h>

static const uint8_t steps[] PROGMEM = {10, 20, 30};

unsigned long blink_in_c(int pin) {
  const unsigned long began = millis();
  boolean level = false;
  byte i;
  pinMode(pin, OUTPUT);
  for (i = 0; i < sizeof steps; ++i) {
    level = !level;
    digitalWrite(pin, level ? HIGH : LOW);
    delay(constrain(pgm_read_byte(&steps[i]), 0, 25));
  }
  _delay_ms(5);
  return millis() - began + max(1, 2) + (bitRead(A0, 1) << 8);
}
