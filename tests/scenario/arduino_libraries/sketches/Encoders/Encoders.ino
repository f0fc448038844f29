#include <Encoder.h>

Encoder knob(2, 3);

// The sketch turns the knob itself: its own writes are edges, as on an AVR.
const int wayUp[4][2] = {{LOW, LOW}, {LOW, HIGH}, {HIGH, HIGH}, {HIGH, LOW}};
int place = 2;

void turn(int edges) {
  for (int i = 0; i < abs(edges); i++) {
    place += edges > 0 ? 1 : -1;
    digitalWrite(2, wayUp[place & 3][0]);
    digitalWrite(3, wayUp[place & 3][1]);
    delay(1);
  }
}

void setup() {
  Serial.begin(9600);
  for (int pin = 2; pin <= 3; pin++) {
    digitalWrite(pin, HIGH);
    pinMode(pin, OUTPUT);
  }
}

void loop() {
  turn(40);
  Serial.println(knob.read());
  turn(-15);
  Serial.println(knob.read());
  knob.write(1000);
  turn(4);
  long position = knob.readAndReset();
  Serial.println(position);
  Serial.println(knob.read());
  delay(100000);
}
