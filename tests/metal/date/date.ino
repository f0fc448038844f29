// The date, as C and C++ know it: in setup(), and three seconds later. A wait for a date ends when
// that has come, and one for a date that is over ends at once.
#include <time.h>

#include <chrono>

static void say(const char* what, time_t seconds) {
  char words[40];
  strftime(words, sizeof words, "%Y-%m-%dT%H:%M:%S", gmtime(&seconds));
  Serial.print(what);
  Serial.print(' ');
  Serial.println(words);
}

void setup() {
  Serial.begin(115200);
  say("began", time(nullptr));
}

void loop(1, 50, 200, 0) {
  static bool said = false;
  if (said) return waitForNextPeriod();
  said = true;
  timespec end;
  clock_gettime(CLOCK_REALTIME, &end);
  end.tv_sec += 3;
  clock_nanosleep(CLOCK_REALTIME, TIMER_ABSTIME, &end, nullptr);
  say("waited", std::chrono::system_clock::to_time_t(std::chrono::system_clock::now()));
  const timespec over = {1000, 0};
  clock_nanosleep(CLOCK_REALTIME, TIMER_ABSTIME, &over, nullptr);
  say("over", time(nullptr));
  waitForNextPeriod();
}
