// The pulse train of sketches/pulse_train on core 1, and on core 0 all that could disturb it:
//
//   core 0   loops 2, 3   want more than their budgets        pins 2, 3   one pulse after another
//            loop 4       asks the network until it answers   pin 4       a pulse a release
//            card         a storm of interrupts; its bottom   pin 5       high while that works
//                         half has 2 of 10 ms
//   core 1   loop 1       no interrupts, no timer             pin 6

#include "asker.h"

TIME_UNIT(us);

Asker asker;

void setup() {
  for (int pin : {2, 3, 4, 5, 6}) pinMode(pin, OUTPUT);
  safeState(6, LOW);
  noInterrupts(ALL, 1);
  noTimer(1);
  if (!asker.open()) Serial.println("no network card");
  interruptsVcpu(NIC, 2000, 10000, 0);
}

void loop(1, 100, 100, 1) {
  delayBusyNanoseconds(100000);
  digitalWrite(6, HIGH);
  digitalWrite(6, LOW);
}

// A fixed number of instructions, not of microseconds: it needs as much CPU when it is preempted.
void pulse(int pin, int length) {
  digitalWrite(pin, HIGH);
  for (int i = 0; i < length; ++i) asm volatile("");
  digitalWrite(pin, LOW);
}

void pulses(int pin) {
  for (int i = 0; i < 1000; ++i) pulse(pin, 5);
}

void loop(2, 4000, 100000, 0) { pulses(2); }
void loop(3, 2000, 100000, 0) { pulses(3); }

void loop(4, 800, 10000, 0) {
  asker.begin();
  pulse(4, 1000);
  waitForNextPeriod();
}
