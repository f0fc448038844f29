#include "arduino/libraries/CapacitiveSensor/CapacitiveSensor.h"

#include "arduino/core/digital_io.h"
#include "arduino/core/timing.h"

namespace {

constexpr long kTimedOut = -2;
constexpr unsigned long kDischargeUs = 10;

}  // namespace

bool CapacitiveSensor::count_until(int level, unsigned long give_up_us) {
    while (digitalRead(receive_) != level) {
        if (micros() >= give_up_us) return false;
        delayMicroseconds(1);
        ++total_;
    }
    return true;
}

bool CapacitiveSensor::sample(unsigned long give_up_us) {
    // Empty the receiving side, let go of it, and charge it through the resistor.
    digitalWrite(send_, LOW);
    pinMode(receive_, OUTPUT);
    digitalWrite(receive_, LOW);
    delayMicroseconds(kDischargeUs);
    pinMode(receive_, INPUT);
    digitalWrite(send_, HIGH);
    if (!count_until(HIGH, give_up_us)) return false;
    // The other way round: full, and discharged through the resistor.
    pinMode(receive_, OUTPUT);
    digitalWrite(receive_, HIGH);
    delayMicroseconds(kDischargeUs);
    pinMode(receive_, INPUT);
    digitalWrite(send_, LOW);
    return count_until(LOW, give_up_us);
}

long CapacitiveSensor::capacitiveSensorRaw(int samples) {
    pinMode(send_, OUTPUT);
    total_ = 0;
    const unsigned long give_up_us = micros() + timeout_ms_ * 1000;
    for (int i = 0; i < samples; ++i) {
        if (!sample(give_up_us)) return kTimedOut;
    }
    return total_;
}

long CapacitiveSensor::capacitiveSensor(int samples) {
    const long total = capacitiveSensorRaw(samples);
    if (total < 0) return total;
    const unsigned long now_ms = millis();
    const bool stale = now_ms - calibrated_ms_ > calibrate_ms_;
    if (lowest_ < 0 || total < lowest_ || stale) {
        lowest_ = total;
        calibrated_ms_ = now_ms;
    }
    return total - lowest_;
}
