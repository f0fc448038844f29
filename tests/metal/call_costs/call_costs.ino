// What this kernel's calls take, and a turn of a core to another loop: each measured by itself, in
// the terms of the simulator ([sim.costs]), and before any of the cases runs (../cases).
//
//   core 1   loop 1 alone, without interrupts: all that passes between two looks at its CPU time is
//            the call's. The handler of pin 22 is on core 0.
//   core 2   loops 2 and 3, released together, do nothing but look at the clock:
//            due ──turn──► loop 2 begins ──turn──► loop 3 begins

#include "runtime/runtime.h"

TIME_UNIT(us);

using namespace std::chrono_literals;
using qduino::board::current;

constexpr int kHandled = 22, kCalls = 200;
Mutex lock;
volatile uint32_t turn_ns;  // 0: not measured yet

void note() {}

void setup() {
  Serial.begin(115200);
  pinMode(kHandled, OUTPUT);
  for (int core : {1, 2}) noInterrupts(ALL, core);
  attachInterruptVcpu(kHandled, note, CHANGE, 100, 1000, 0);
  lock.heldBy(1, 100us);
}

/// Nanoseconds of CPU time, on average.
template <typename Call>
uint32_t cost(Call call) {
  const auto before = current().cpu_time();
  for (int i = 0; i < kCalls; ++i) call();
  return (uint32_t)((current().cpu_time() - before).count() / kCalls);
}

void say(const char* call, uint32_t ns) {
  Serial.print("cost ");
  Serial.print(call);
  Serial.print(" ");
  Serial.println(ns);
}

void loop(1, 50000, 100000, 1) {
  static bool measured, level;
  static uint32_t now, write, sleep, both;
  if (!measured) {
    measured = true;
    now = cost([] { (void)current().now(); });
    write = cost([] { digitalWrite(kHandled, level = !level); });
    sleep = cost([] { current().sleep_until(current().now() + 50us); });
    both = cost([] { lock.lock(), lock.unlock(); });
  } else if (turn_ns != 0) {
    say("now", now);
    say("pin_write", write);
    say("sleep", sleep - now);
    say("lock", both / 2);
    say("context_switch", turn_ns);
    turn_ns = 0;
  }
  waitForNextPeriod();
}

void loop(2, 100, 1000, 2) { waitForNextPeriod(); }

void loop(3, 200, 1000, 2) {
  static int64_t until_begun;
  static int releases;
  const auto due = qduino::runtime::Runtime::current()->loop(3)->clock.nominal();
  until_begun += (current().now() - due).count();
  if (++releases == 64) turn_ns = (uint32_t)(until_begun / releases / 2);
  waitForNextPeriod();
}
