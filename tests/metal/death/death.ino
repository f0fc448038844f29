// Dies in the way that a letter on Serial asks for, with pins 6 and 7 off their safe levels and a
// loop on the other core that keeps moving pin 6.
//
//   n  a store through a null pointer      s  a stack that is full
//   c  a broken contract                   d  a division by zero

Mutex lock;

int fill(int depth) {
  volatile char room[1000];
  room[depth % 1000] = 1;
  return fill(depth + 1) + room[0];
}

void setup() {
  Serial.begin(115200);
  Serial.println("ready");
  pinMode(6, OUTPUT);
  pinMode(7, OUTPUT);
  safeState(6, LOW);
  safeState(7, HIGH);
  lock.heldBy(1, 1);
}

void loop(1, 10, 100, 0) {
  volatile int* volatile nowhere = nullptr;
  volatile int one = 1, zero = 0;
  digitalWrite(7, LOW);
  switch (Serial.read()) {
    case 'n': *nowhere = 1; break;
    case 's': fill(0); break;
    case 'c': lock.unlock(); break;
    case 'd': one = one / zero; break;
  }
  waitForNextPeriod();
}

void loop(2, 100, 100, 1) {
  digitalWrite(6, HIGH);
  delayMicroseconds(50);
}
