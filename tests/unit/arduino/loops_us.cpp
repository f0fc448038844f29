// A second file of the same sketch, in microseconds.
#include <Arduino.h>

TIME_UNIT(us);

void loop(11, 100, 100, 1) { waitForNextPeriod(); }
void loop(12, 1ms, 8ms) {}

void routed_in_microseconds() {
    interruptsVcpu(I2C, 200, 1000);
    interruptsVcpu(SPI, 1ms, 100ms, 0);
    attachInterruptVcpu(
        5, [] {}, RISING, 50, 500, 1);
}
