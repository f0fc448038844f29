// A sketch for a core that Linux gave up (beside_test.py): pulses on pin 6; pin 7 is high while the
// sketch is well, and low in its safe state; pin 8 the other way round; pin 9 has no safe level.

TIME_UNIT(us);

void setup() {
  for (const int pin : {6, 7, 8, 9}) pinMode(pin, OUTPUT);
  safeState(7, LOW);
  safeState(8, HIGH);
  digitalWrite(7, HIGH);
  digitalWrite(8, LOW);
  digitalWrite(9, HIGH);
  Serial.begin(115200);
  Serial.println("sketch: ready");
}

void loop(1, 2000, 2000, 1) {  // a look at Linux comes in the middle of a pass
  for (int i = 0; i < 20; ++i) {
    digitalWrite(6, HIGH);
    digitalWrite(6, LOW);
    digitalWrite(7, HIGH);  // for as long as anybody lets it
    delayBusyMicroseconds(100);
  }
}
