#include "BusThermometer.h"

void BusThermometer::request() {
    bus_->reset();
    bus_->skip();
    bus_->write(0x44);
    const unsigned long from = millis();
    while (bus_->read() != 0xFF && millis() - from < 1000) delay(10);
}

float BusThermometer::celsius(const byte rom[8]) {
    byte bytes[9];
    if (!bus_->reset()) return -127;
    bus_->select(rom);
    bus_->write(0xBE);
    for (byte& value : bytes) value = bus_->read();
    if (OneLineBus::crc8(bytes, 8) != bytes[8]) return -127;
    return int16_t(bytes[1] << 8 | bytes[0]) / 16.0;
}

void BusThermometer::set_resolution(byte bits) {
    bus_->reset();
    bus_->skip();
    bus_->write(0x4E);
    bus_->write(0x4B);
    bus_->write(0x46);
    bus_->write((bits - 9) << 5 | 0x1F);
}
