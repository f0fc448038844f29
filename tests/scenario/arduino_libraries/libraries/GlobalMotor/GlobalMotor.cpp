#include "GlobalMotor.h"

GlobalMotor::GlobalMotor(uint8_t first, uint8_t enable) : enable_(enable) {
    for (uint8_t pin = first; pin < first + 4; pin++) pinMode(pin, OUTPUT);
    pinMode(enable, OUTPUT);
    digitalWrite(enable, HIGH);
    analogWrite(first, 255);
}

GlobalSwitch::GlobalSwitch(uint8_t pin) {
    pinMode(pin, INPUT_PULLUP);
    pressed_ = digitalRead(pin) == LOW;
}
