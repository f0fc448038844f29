// A sketch with a heater on pin 5, that hangs in the way that its environment says, or waits for
// long and does not hang.
//
//   HANG=setup     setup() never ends
//   HANG=poll      loop 1 polls a pin for ever
//   HANG=delay     loop 1 sleeps for ten hours
//   HANG=promised  loop 2 polls for ever, and had promised to get on every 1.5 s
//   HANG=spin      loop 1 spins for ever
//   HANG=handler   the handler of pin 6 polls for ever
//
// HANG=overrun: loop 3 takes more than its budget once, and then waits for longer than the
// supervisor's bound until it has some again. That is no hang.
//
// Loop 1 waits for its periods, loop 2 and loop() never do.
//
// These wait as long as a hang takes, rightly, and then end the sketch:
//
//   HANG=slow-setup  HANG=patient  HANG=free  HANG=unpromised  HANG=classic
#include <time.h>

#include <string>

static const char* const waits = getenv("HANG");
static bool hangs(const char* how) {
  return waits && std::string(waits) == how;
}

// Longer than every limit that holds for it, and than the supervisor's bound.
static void wait_long(bool says_so) {
  for (int i = 0; i < 750; ++i) {
    delay(10);
    if (says_so) progress();
  }
  stopSketch();
}

static void stamp() {
  fprintf(stderr, "HANG %llu\n", nanos());
}

static void poll_pin() {
  stamp();
  while (digitalRead(7) == LOW) delay(1);
}

void setup() {
  safeState(5, LOW);
  pinMode(5, OUTPUT);
  digitalWrite(5, HIGH);
  if (hangs("setup")) {
    stamp();
    for (;;) delay(100);
  }
  if (hangs("slow-setup")) wait_long(true);
  if (hangs("promised")) promiseProgress(2, 1500);
  if (hangs("free")) promiseProgress(1, 0);
  if (hangs("handler")) attachInterruptVcpu(6, poll_pin, RISING, 1, 10);
}

void loop(1, 2, 10) {
  waitForNextPeriod();
  if (millis() < 500) return;
  if (hangs("poll")) poll_pin();
  if (hangs("spin")) {
    stamp();
    for (static volatile bool for_ever = true; for_ever;) {
    }
  }
  if (hangs("delay")) {
    stamp();
    delay(36000000ul);
  }
  if (hangs("patient")) wait_long(true);
  if (hangs("free")) wait_long(false);
  if (hangs("slow-setup")) stopSketch();
}

void loop(2, 2, 20) {
  delay(5);
  if (millis() < 500) return;
  if (hangs("promised")) poll_pin();
  if (hangs("unpromised")) wait_long(false);
}

void loop(3, 2, 5000) {
  if (!hangs("overrun")) return waitForNextPeriod();
  for (timespec used{}; used.tv_nsec < 4000000;) clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
  stopSketch();
}

void loop() {
  delay(50);
  if (hangs("classic") && millis() > 500) wait_long(false);
}
