#include "OneLineBus.h"

byte OneLineBus::reset() {
    byte tries = 125;
    pinMode(pin_, INPUT);
    do {  // somebody may still hold the line
        if (--tries == 0) return 0;
        delayMicroseconds(2);
    } while (!digitalRead(pin_));
    digitalWrite(pin_, LOW);
    pinMode(pin_, OUTPUT);
    delayMicroseconds(480);
    noInterrupts();
    pinMode(pin_, INPUT);
    delayMicroseconds(70);
    const byte present = !digitalRead(pin_);
    interrupts();
    delayMicroseconds(410);
    return present;
}

void OneLineBus::write_bit(byte bit) {
    noInterrupts();
    digitalWrite(pin_, LOW);
    pinMode(pin_, OUTPUT);
    delayMicroseconds(bit ? 10 : 65);
    digitalWrite(pin_, HIGH);
    interrupts();
    delayMicroseconds(bit ? 55 : 5);
}

byte OneLineBus::read_bit() {
    noInterrupts();
    pinMode(pin_, OUTPUT);
    digitalWrite(pin_, LOW);
    delayMicroseconds(3);
    pinMode(pin_, INPUT);
    delayMicroseconds(10);
    const byte bit = digitalRead(pin_);
    interrupts();
    delayMicroseconds(53);
    return bit;
}

void OneLineBus::write(byte value) {
    for (byte mask = 1; mask; mask <<= 1) write_bit(value & mask);
    pinMode(pin_, INPUT);
}

byte OneLineBus::read() {
    byte value = 0;
    for (byte mask = 1; mask; mask <<= 1)
        if (read_bit()) value |= mask;
    return value;
}

void OneLineBus::select(const byte rom[8]) {
    write(0x55);
    for (byte i = 0; i < 8; i++) write(rom[i]);
}

bool OneLineBus::search(byte rom[8]) {
    if (done_ || !reset()) return false;
    write(0xF0);
    int branch = -1;
    for (int i = 0; i < 64; i++) {
        const byte zero_missing = read_bit(), one_missing = read_bit();
        if (zero_missing && one_missing) return false;
        byte way = zero_missing;
        if (!zero_missing && !one_missing) {
            way = i < last_branch_ && last_branch_ != 64 ? bitRead(rom_[i / 8], i % 8) : i == last_branch_;
            if (!way) branch = i;
        }
        bitWrite(rom_[i / 8], i % 8, way);
        write_bit(way);
    }
    pinMode(pin_, INPUT);
    last_branch_ = branch;
    done_ = branch < 0;
    memcpy(rom, rom_, 8);
    return true;
}

byte OneLineBus::crc8(const byte* bytes, byte count) {
    byte crc = 0;
    for (byte i = 0; i < count; i++) {
        byte value = bytes[i];
        for (byte bit = 0; bit < 8; bit++) {
            const byte mix = (crc ^ value) & 1;
            crc >>= 1;
            if (mix) crc ^= 0x8C;
            value >>= 1;
        }
    }
    return crc;
}
