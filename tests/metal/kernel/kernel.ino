// What the kernel of board/metal keeps, each on pins of its own, for the witness outside:
//
//   core 0   loops 1, 2   want more than their budgets         pins 2, 3   writes as 20 : 10
//            loop 6       prints, echoes, makes edges          pin 11, and 12 from the handler
//            handlers     of an input that is driven by wire    pins 21, 22
//   core 1   loop 7       a pulse train; no interrupts there   pin 6
//   core 2   loops 3…5    high waits for the lock of low       pin 10 while high waits, pin 5 while
//                         while mid wants to run               low holds, pin 4 while mid runs

Mutex lock;

void follow() {
  digitalWrite(12, HIGH);
  digitalWrite(12, LOW);
}

void answer() {
  digitalWrite(22, HIGH);
  digitalWrite(22, LOW);
}

void setup() {
  Serial.begin(115200);
  Serial.println("ready");
  for (int pin : {2, 3, 4, 5, 6, 10, 11, 12, 22}) pinMode(pin, OUTPUT);
  safeState(6, LOW);
  noInterrupts(ALL, 1);
  noTimer(1);
  interruptsVcpu(UART, 1, 10, 0);
  attachInterruptVcpu(11, follow, RISING, 1, 20, 0);
  attachInterruptVcpu(21, answer, RISING, 1, 40, 0);
  lock.heldBy(3, 1);
  lock.heldBy(5, 50);
  while (Serial.available() == 0) delay(1);  // the test is there
}

void pulse(int pin) {
  digitalWrite(pin, HIGH);
  delayMicroseconds(100);
  digitalWrite(pin, LOW);
}

void loop(1, 20, 100, 0) { pulse(2); }
void loop(2, 10, 100, 0) { pulse(3); }

void loop(3, 5, 200, 2, 20, 1) {
  delay(20);
  digitalWrite(10, HIGH);
  lock.lock();
  digitalWrite(10, LOW);
  lock.unlock();
  waitForNextPeriod();
}

void loop(4, 12, 250, 2, 30, 1) {
  delay(30);
  for (int i = 0; i < 100; ++i) pulse(4);
  waitForNextPeriod();
}

void loop(5, 60, 400, 2) {
  lock.lock();
  digitalWrite(5, HIGH);
  delayMicroseconds(45000);
  digitalWrite(5, LOW);
  lock.unlock();
  waitForNextPeriod();
}

thread_local int line = 100;  // each loop has its own

void loop(6, 2, 10, 0) {
  Serial.print("line ");
  Serial.print(++line);
  Serial.println(" of many, long enough to need several turns of the line's sixteen bytes");
  while (Serial.available() > 0) {
    Serial.print("heard ");
    Serial.println(Serial.read());
  }
  pulse(11);
  waitForNextPeriod();
}

void loop(7, 100, 100, 1) { pulse(6); }
