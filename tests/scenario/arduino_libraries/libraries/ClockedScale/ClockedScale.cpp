#include "ClockedScale.h"

void ClockedScale::begin(byte data, byte clock, byte gain) {
    data_ = data;
    clock_ = clock;
    pinMode(clock_, OUTPUT);
    pinMode(data_, INPUT_PULLUP);
    set_gain(gain);
}

void ClockedScale::set_gain(byte gain) { pulses_ = gain == 128 ? 1 : gain == 32 ? 2 : 3; }

long ClockedScale::read() {
    wait_ready();
    // Nothing may come between the edges: a pulse of 60 us switches the chip off.
    noInterrupts();
    unsigned long value = 0;
    for (byte part = 0; part < 3; part++) value = value << 8 | shiftIn(data_, clock_, MSBFIRST);
    for (byte pulse = 0; pulse < pulses_; pulse++) {
        digitalWrite(clock_, HIGH);
        delayMicroseconds(1);
        digitalWrite(clock_, LOW);
        delayMicroseconds(1);
    }
    interrupts();
    if (value & 0x800000) value |= 0xFF000000;
    return static_cast<long>(value);  // -1 is 0xFFFFFFFF where a long has 32 bits
}

long ClockedScale::read_average(byte times) {
    long sum = 0;
    for (byte i = 0; i < times; i++) sum += read();
    return sum / times;
}

void ClockedScale::power_down() {
    digitalWrite(clock_, LOW);
    digitalWrite(clock_, HIGH);
}
