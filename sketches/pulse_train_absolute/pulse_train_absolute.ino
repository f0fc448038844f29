// A 10 kHz pulse train without drift: each pulse at its own instant, whatever the
// one before it cost. Compare sketches/pulse_train, whose wait is relative.
//
//   pin 6  _|‾|__________|‾|__________|‾|___
//          due          due + 100 us  due + 200 us

void setup() {
  pinMode(6, OUTPUT);
  safeState(6, LOW);
  noInterrupts(ALL, 1);
  noTimer(1);
}

void loop(1, 100us, 100us, 1) {
  static auto due = timeNow();
  due += 100us;
  delayBusyUntil(due);
  digitalWrite(6, HIGH);
  digitalWrite(6, LOW);
}
