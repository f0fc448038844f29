// What the C and C++ libraries say of the time, and whether their waits let others run. Loop 1 says
// it once, in milliseconds.
#include <time.h>

#include <chrono>

static long milliseconds(clockid_t clock) {
  timespec now;
  if (clock_gettime(clock, &now) != 0) return -1;
  return now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

static volatile unsigned long turns = 0;

void setup() {
  Serial.begin(115200);
  Serial.print("setup: ");
  Serial.println(milliseconds(CLOCK_THREAD_CPUTIME_ID));
}

void loop(1, 50, 200, 0) {
  static bool said = false;
  if (said) return waitForNextPeriod();
  said = true;
  const long cpu = milliseconds(CLOCK_THREAD_CPUTIME_ID), began = milliseconds(CLOCK_MONOTONIC);
  const auto steady = std::chrono::steady_clock::now();
  delayBusyMicroseconds(10000);
  const long worked = milliseconds(CLOCK_THREAD_CPUTIME_ID) - cpu;
  const unsigned long before = turns;
  const timespec wait = {0, 20000000};
  const int slept = nanosleep(&wait, nullptr);
  const long lasted = milliseconds(CLOCK_MONOTONIC) - began;
  const long by_steady = std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::steady_clock::now() - steady).count();
  const long idle = milliseconds(CLOCK_THREAD_CPUTIME_ID) - cpu - worked;
  const timespec wrong = {0, -1};
  timespec any;
  Serial.print("worked ");
  Serial.print(worked);
  Serial.print(" lasted ");
  Serial.print(lasted);
  Serial.print(" steady ");
  Serial.print(by_steady);
  Serial.print(" idle ");
  Serial.print(idle);
  Serial.print(" others ");
  Serial.print(turns - before);
  Serial.print(" slept ");
  Serial.print(slept);
  Serial.print(" wrong ");
  Serial.print(nanosleep(&wrong, nullptr));
  Serial.print(clock_gettime((clockid_t)99, &any));
  Serial.println(".");
  waitForNextPeriod();
}

void loop(2, 1, 4, 0) {
  turns = turns + 1;
  waitForNextPeriod();
}
