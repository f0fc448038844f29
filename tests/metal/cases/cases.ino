// Sets of loops, each on a core of its own and near to the edge of what admission takes. Each loop
// measures its worst response, from when a release was due to when it was done; core 7 says them.
//
//   core 0   loop 1 asks a device and needs its answer, whose bottom half has a long period; below
//            it loop 2
//   core 1   the same with a bottom half of the client's period                      loops 3, 4
//   core 2   loop 6 sleeps through a part of every second period before it computes    loops 5, 6
//   core 3   three loops whose U is above the bound                                  loops 7…9
//   core 4   short ones, in which the kernel's own time shows                        loops 10…12
//   core 5   a lock that the lower one holds for longer than the higher computes     loops 13, 14
//   core 6   a bottom half that comes 2,000 times a second                          loop 15
//   core 7   what asks for that                                                      loops 16, 17
//
// The same source runs in the simulator, with this kernel's costs (costs.toml), and on the kernel.

#include <array>
#include <atomic>

#include "runtime/runtime.h"

TIME_UNIT(us);

using namespace std::chrono_literals;
using qduino::board::current;

std::array<std::atomic<int64_t>, 17> worst_ns;
Mutex lock;
volatile uint32_t asked[2], answered[2];

/// So much CPU time, whoever else has the core meanwhile.
void work(int us) {
  qduino::Nanoseconds left = std::chrono::microseconds(us);
  for (const auto end = current().cpu_time() + left; left > 0ns; left = end - current().cpu_time()) current().busy_for(left);
}

void done(int loop) {
  const auto due = qduino::runtime::Runtime::current()->loop(loop)->clock.nominal();
  const int64_t response = (current().now() - due).count();
  if (response > worst_ns[loop]) worst_ns[loop] = response;
  waitForNextPeriod();
}

void answer(int which) {
  work(400);
  answered[which] = asked[which];
}
void answer_0() { answer(0); }
void answer_1() { answer(1); }
void note() {}

void setup() {
  Serial.begin(115200);
  for (int pin : {20, 21, 22}) pinMode(pin, OUTPUT);
  for (int core = 0; core < 7; ++core) noInterrupts(ALL, core);
  attachInterruptVcpu(20, answer_0, CHANGE, 5000, 50000, 0);
  attachInterruptVcpu(21, answer_1, CHANGE, 1000, 10000, 1);
  attachInterruptVcpu(22, note, CHANGE, 100, 1000, 6);
  lock.heldBy(13, 500us);
  lock.heldBy(14, 4ms);
}

void ask(int loop, int which) {
  static bool level[2];
  level[which] = !level[which];
  asked[which] = asked[which] + 1;
  digitalWrite(20 + which, level[which]);
  while (answered[which] != asked[which]) current().sleep_until(current().now() + 100us);
  work(400);
  done(loop);
}

void loop(1, 1000, 10000, 0) { ask(1, 0); }
void loop(2, 12000, 20000, 0) { work(11800); done(2); }

void loop(3, 1000, 10000, 1) { ask(3, 1); }
void loop(4, 12000, 20000, 1) { work(11800); done(4); }

void loop(5, 6000, 20000, 2) { work(5900); done(5); }
void loop(6, 8000, 30000, 2, 8000) {
  static int release = 0;
  if (release++ % 2 == 0) current().sleep_until(current().now() + 8ms);
  work(7900);
  done(6);
}

void loop(7, 4000, 10000, 3) { work(3900); done(7); }
void loop(8, 20000, 100000, 3) { work(19800); done(8); }
void loop(9, 25000, 120000, 3) { work(24800); done(9); }

void loop(10, 150, 1000, 4) { work(120); done(10); }
void loop(11, 300, 2000, 4) { work(260); done(11); }
void loop(12, 1000, 5000, 4) { work(950); done(12); }

void loop(13, 1000, 10000, 5) {
  lock.lock();
  work(400);
  lock.unlock();
  done(13);
}
void loop(14, 20000, 100000, 5) {
  work(14000);
  lock.lock();
  work(3900);
  lock.unlock();
  done(14);
}

void loop(15, 60000, 100000, 6) { work(59000); done(15); }

void loop(16, 100, 500, 7) {
  static bool level;
  level = !level;
  digitalWrite(22, level);
  done(16);
}

void loop(17, 5000, 50000, 7) {
  static int release = 0;
  if (worst_ns[2] > 0 && ++release == 5) {  // core 0 begins last, when the report is said
    // The line's interrupts come to this core, and no more responses count once it speaks.
    std::array<int64_t, 17> seen;
    for (int loop = 1; loop <= 16; ++loop) seen[loop] = worst_ns[loop];
    for (int loop = 1; loop <= 16; ++loop) {
      Serial.print("worst ");
      Serial.print(loop);
      Serial.print(" ");
      Serial.println((uint32_t)seen[loop]);
    }
  }
  waitForNextPeriod();
}
