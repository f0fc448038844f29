// The bottom half of the serial lines has 1 ms in 20 ms of core 0, above a loop that computes
// for 30 ms of each 100.

#include <signal.h>
#include <unistd.h>

void setup() {
  Serial.begin(115200);
  interruptsVcpu(UART, 1, 20, 0);
}

void loop(1, 40, 100, 0) {
  static int round = 0;
  const unsigned long begin = micros();
  while (micros() - begin < 30000) {
  }
  if (++round == 50) kill(getpid(), SIGTERM);
  waitForNextPeriod();
}
