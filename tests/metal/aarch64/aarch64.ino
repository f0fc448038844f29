// Inputs of a real chip: pin 5 follows pin 4 by interrupt, pin 6 counts the rising edges of pin 3
// on a loop of its own, and a loop on core 1 makes pulses meanwhile on pin 7. Two loops of core 0,
// of which one interrupts the other, add up what they know the sum of, in as many registers as
// there are.

volatile int rises = 0;

void follow() { digitalWrite(5, digitalRead(4)); }
void count() { rises = rises + 1; }

/// 0.5 and 1.5 and … in 24 sums at once. They are the same in every call, or a register was lost.
bool adds_up(double first) {
  double sums[24];
  for (int i = 0; i < 24; ++i) sums[i] = first + i;
  for (int turn = 0; turn < 2000; ++turn) {
#pragma GCC unroll 24
    for (int i = 0; i < 24; ++i) sums[i] += 0.25;
  }
  for (int i = 0; i < 24; ++i)
    if (sums[i] != first + i + 500) return false;
  return true;
}

void check(const char* who, double first) {
  if (!adds_up(first)) {
    Serial.print(who);
    Serial.println(" has lost a register");
  }
}

void setup() {
  Serial.begin(115200);
  for (int pin : {5, 6, 7}) pinMode(pin, OUTPUT);
  for (int pin : {3, 4}) pinMode(pin, INPUT);
  safeState(5, HIGH);
  attachInterrupt(digitalPinToInterrupt(4), follow, CHANGE);
  attachInterrupt(digitalPinToInterrupt(3), count, RISING);
  Serial.println("ready");
}

void loop(1, 5ms, 20ms, 0) {
  static int told = -1;  // "rises 0": the loops run, and with them the handlers
  digitalWrite(6, rises % 2 ? HIGH : LOW);
  if (rises == told) return;
  told = rises;
  Serial.print("rises ");
  Serial.println(told);
}

void loop(3, 1ms, 10ms, 0) { check("loop 3", 0.5); }
void loop(4, 8ms, 40ms, 0) { check("loop 4", 7.5); }

void loop(2, 100us, 1ms, 1) {
  digitalWrite(7, HIGH);
  digitalWrite(7, LOW);
}
