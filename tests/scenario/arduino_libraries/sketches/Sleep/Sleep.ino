#include <LowPower.h>

volatile bool woken = false;
const int receiver = 7;

void wake() { woken = true; }

void say(const char* what, unsigned long since) {
  Serial.print(what);
  Serial.print(' ');
  Serial.println(millis() - since);
}

void setup() {
  Serial.begin(9600);
  pinMode(receiver, INPUT_PULLUP);
  attachInterrupt(digitalPinToInterrupt(receiver), wake, FALLING);
}

void loop() {
  unsigned long began = millis();
  LowPower.powerDown(SLEEP_FOREVER, ADC_OFF, BOD_OFF);
  say(woken ? "woken" : "by itself", began);
  detachInterrupt(digitalPinToInterrupt(receiver));
  delay(300);
  began = millis();
  LowPower.powerDown(SLEEP_2S, ADC_OFF, BOD_OFF);
  say("slept", began);
  began = millis();
  LowPower.idle(SLEEP_120MS, ADC_OFF, TIMER2_OFF, TIMER1_OFF, TIMER0_OFF, SPI_OFF, USART0_OFF, TWI_OFF);
  say("idle", began);
  delay(60000);
}
