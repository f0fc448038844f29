#include <TimerUser.h>

void setup() {
  Serial.begin(9600);
  TimerUser::begin();
}

void loop() {
  delay(901);
  Serial.print(TimerUser::fast());
  Serial.print(' ');
  Serial.println(TimerUser::slow());
}
