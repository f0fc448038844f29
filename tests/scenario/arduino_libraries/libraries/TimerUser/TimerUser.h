// Counts on two hardware timers, and makes PWM on one of them.
#pragma once
#include <Arduino.h>

namespace TimerUser {
void begin();
unsigned fast();
unsigned slow();
}  // namespace TimerUser
