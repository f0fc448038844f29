// The pulse train of sketches/pulse_train on core 1, and on core 0 all that could disturb it:
//
//   core 0   loops 2, 3   want more than their budgets            pins 2, 3   writes as 20 : 10
//            loop 4       asks the network until it answers       pin 4       a pulse a release
//            card         a storm of interrupts; its bottom half on an I/O VCPU, 1 of 10 ms
//   core 1   loop 1       no interrupts, no timer                 pin 6

#include "network_card.h"

TIME_UNIT(us);

storm::NetworkCard card;

void setup() {
  for (int pin : {2, 3, 4, 6}) pinMode(pin, OUTPUT);
  safeState(6, LOW);
  noInterrupts(ALL, 1);
  noTimer(1);
  if (!card.open()) Serial.println("no network card");
  interruptsVcpu(NIC, 1000, 10000, 0);
}

void loop(1, 100, 100, 1) {
  delayBusyNanoseconds(100000);
  digitalWrite(6, HIGH);
  digitalWrite(6, LOW);
}

// A fixed number of instructions, not of microseconds: it needs as much CPU when it is preempted.
void pulse(int pin) {
  digitalWrite(pin, HIGH);
  for (int i = 0; i < 1000; ++i) asm volatile("");
  digitalWrite(pin, LOW);
}

void loop(2, 20000, 100000, 0) { pulse(2); }
void loop(3, 10000, 100000, 0) { pulse(3); }

void loop(4, 2000, 10000, 0) {
  if (card.answers() == 0) card.ask();
  pulse(4);
  waitForNextPeriod();
}
