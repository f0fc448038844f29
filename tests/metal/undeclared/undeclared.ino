// Loop 1 sleeps ten times in a release and declares no sleep. Each sleep is a turn to it that is in
// no R: loop 2, below it, is not to be later by that.

void setup() {
  Serial.begin(115200);
  noInterrupts(ALL, 0);
}

void loop(1, 2, 20, 0) {
  for (int piece = 0; piece < 10; ++piece) delay(1);
  waitForNextPeriod();
}

void loop(2, 5, 40, 0) {
  delayBusyMicroseconds(2000);
  waitForNextPeriod();
}
