// A chain of locks through three cores: high waits for what link holds, and link for what low
// holds. So low ranks as high, on a core that has never heard of it, and mid has to wait there.
//
//   core 2   high             ░░░░░░░░░ asks for A            pin 10 until it has it
//   core 1   link   A──░░░░░░░░░░░░░░░ asks for B             pin 11 until it has it
//   core 0   mid             ████        ██████               pin 4: a pulse each 100 us
//            low    B──██████    ██████ gives B back          pin 5 while it holds B

Mutex A, B;

void setup() {
  for (int pin : {4, 5, 10, 11}) pinMode(pin, OUTPUT);
  B.heldBy(5, 50);
  B.heldBy(3, 1);
  A.heldBy(3, 80);
  A.heldBy(2, 1);
}

void loop(2, 5, 400, 2, 40, 1) {  // high
  delay(35);
  digitalWrite(10, HIGH);
  A.lock();
  digitalWrite(10, LOW);
  A.unlock();
  waitForNextPeriod();
}

void loop(3, 5, 600, 1, 200, 1) {  // link
  delay(10);
  A.lock();
  digitalWrite(11, HIGH);
  B.lock();
  digitalWrite(11, LOW);
  B.unlock();
  A.unlock();
  waitForNextPeriod();
}

void loop(4, 12, 500, 0, 40, 1) {  // mid
  delay(30);
  for (int i = 0; i < 100; ++i) {
    digitalWrite(4, HIGH);
    delayMicroseconds(100);
    digitalWrite(4, LOW);
  }
  waitForNextPeriod();
}

void loop(5, 60, 800, 0) {  // low
  B.lock();
  digitalWrite(5, HIGH);
  delayMicroseconds(45000);
  digitalWrite(5, LOW);
  B.unlock();
  waitForNextPeriod();
}
