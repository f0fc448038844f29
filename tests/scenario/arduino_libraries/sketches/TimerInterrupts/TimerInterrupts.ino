#define USE_TIMER_1 true
#define USE_TIMER_3 true
#include <TimerInterrupt.h>
#include <ISR_Timer.h>

#include <Counted.h>

ISR_Timer timers;

void serve() { timers.run(); }

void setup() {
  Serial.begin(115200);
  ITimer1.init();
  if (!ITimer1.attachInterruptInterval(10, serve)) Serial.println("refused");
  timers.setInterval(50, Counted::up);
  timers.setTimeout(120, Counted::once);
  ITimer3.init();
  ITimer3.attachInterrupt(100.0, Counted::by, 3u, 250);
}

void loop() {
  delay(505);
  Serial.print(Counted::ups());
  Serial.print(' ');
  Serial.print(Counted::onces());
  Serial.print(' ');
  Serial.print(Counted::sum());
  Serial.print(' ');
  Serial.println(timers.getNumTimers());
  delay(10000);
}
