// The classic: the light on pin 13, one second on, one second off.
//
// Its one loop is a VCPU like any other: 80 of every 100 ms on some core, and delay() gives the
// time back. safeState() is QduinoMC's: the light is off when the sketch has ended, in whatever
// way.

void setup() {
  pinMode(LED_BUILTIN, OUTPUT);
  safeState(LED_BUILTIN, LOW);
}

void loop() {
  digitalWrite(LED_BUILTIN, HIGH);
  delay(1000);
  digitalWrite(LED_BUILTIN, LOW);
  delay(1000);
}
