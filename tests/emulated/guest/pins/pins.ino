// Uses every ability of the driver of real pins. The test outside sets the input lines of the
// emulated chip and watches its outputs.
//
//   pin 6 ──edge──► follow(): reads it, pin 5 follows     (both edges)
//   pin 7 ──edge──► rises is counted                      (rising edges alone)
//   pin 3 ──edge──► button is counted                     (both edges; the machine's power button)
//   pin 1 ──edge──► the sketch ends: stopped, or killed
//   pin 4           loop 1 writes it and reads it back
//   pin 5           is high when the sketch has ended: its safe state

#include <signal.h>
#include <stdlib.h>
#include <unistd.h>

volatile int follows = 0, rises = 0, button = 0, echoes = 0, lies = 0;

void follow() {
  digitalWrite(5, digitalRead(6));
  follows = follows + 1;
}
void rise() { rises = rises + 1; }
void press() { button = button + 1; }
void end() { kill(getpid(), getenv("SKETCH_ENDS_BY_KILL") ? SIGKILL : SIGTERM); }

void setup() {
  Serial.begin(115200);
  for (int pin : {1, 3, 6, 7}) pinMode(pin, INPUT);
  pinMode(4, OUTPUT);
  pinMode(5, OUTPUT);
  safeState(5, HIGH);
  attachInterrupt(digitalPinToInterrupt(6), follow, CHANGE);
  attachInterrupt(digitalPinToInterrupt(7), rise, RISING);
  attachInterrupt(digitalPinToInterrupt(3), press, CHANGE);
  attachInterrupt(digitalPinToInterrupt(1), end, RISING);
  Serial.println("sketch: ready");
}

// Writes pin 4 and asks the chip what it is.
void loop(1, 5, 50, 0) {
  static bool level = false;
  level = !level;
  digitalWrite(4, level);
  if (digitalRead(4) == level) echoes = echoes + 1;
  else lies = lies + 1;
  waitForNextPeriod();
}

// Says what was counted, whenever it has changed.
void loop(2, 5, 20, 0) {
  static int told = -1;
  const int all = follows + rises + button;
  if (all != told) {
    told = all;
    Serial.print("sketch: follows ");
    Serial.print(follows);
    Serial.print(" rises ");
    Serial.print(rises);
    Serial.print(" button ");
    Serial.print(button);
    Serial.print(" echoes ");
    Serial.print(echoes);
    Serial.print(" lies ");
    Serial.println(lies);
  }
  waitForNextPeriod();
}
