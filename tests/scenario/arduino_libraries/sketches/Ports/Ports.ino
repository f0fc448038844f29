#include <FastPin.h>

void setup() {
  Serial.begin(9600);
  DDRB |= _BV(7);    // pin 13
  PORTB |= _BV(7);
  Serial.println(digitalRead(13));
  PORTB &= ~_BV(7);
  Serial.println(digitalRead(13));
  PINB = _BV(7);
  Serial.println(PINB & _BV(7), HEX);
  FastPin fast(12);
  fast.high();
  Serial.println(PORTB, HEX);
  Serial.println(fast.way());
  Serial.println(*portInputRegister(digitalPinToPort(12)) & digitalPinToBitMask(12), HEX);
}

void loop() { delay(1000); }
