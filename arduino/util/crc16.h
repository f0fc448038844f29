/* avr-libc's check sums, a byte at a time. (avr-libc user manual, <util/crc16.h>, which gives the
 * polynomials; check values by the catalogue of parametrised CRC algorithms,
 * reveng.sourceforge.io.)
 *
 * This file is C and C++. */
#pragma once

#include <stdint.h>

/** One byte into a check sum whose lowest bit goes first; `polynomial` is mirrored. */
static inline uint16_t qduino_crc_low_first(uint16_t crc, uint8_t data, uint16_t polynomial) {
    int i;
    crc = (uint16_t)(crc ^ data);
    for (i = 0; i < 8; ++i) crc = (uint16_t)((crc & 1) ? (crc >> 1) ^ polynomial : crc >> 1);
    return crc;
}

/** x¹⁶ + x¹⁵ + x² + 1; begins with 0xffff on a bus (Modbus), with 0 for files (ARC). */
static inline uint16_t _crc16_update(uint16_t crc, uint8_t data) {
    return qduino_crc_low_first(crc, data, 0xa001);
}
/** x¹⁶ + x¹² + x⁵ + 1, the lowest bit first; begins with 0xffff. */
static inline uint16_t _crc_ccitt_update(uint16_t crc, uint8_t data) {
    return qduino_crc_low_first(crc, data, 0x8408);
}
/** x⁸ + x⁵ + x⁴ + 1: Maxim's 1-Wire; begins with 0. */
static inline uint8_t _crc_ibutton_update(uint8_t crc, uint8_t data) {
    return (uint8_t)qduino_crc_low_first(crc, data, 0x8c);
}
/** x¹⁶ + x¹² + x⁵ + 1, the highest bit first; begins with 0. */
static inline uint16_t _crc_xmodem_update(uint16_t crc, uint8_t data) {
    int i;
    crc = (uint16_t)(crc ^ (data << 8));
    for (i = 0; i < 8; ++i) crc = (uint16_t)((crc & 0x8000) ? (crc << 1) ^ 0x1021 : crc << 1);
    return crc;
}
/** x⁸ + x² + x + 1, the highest bit first; begins with 0. */
static inline uint8_t _crc8_ccitt_update(uint8_t crc, uint8_t data) {
    int i;
    crc = (uint8_t)(crc ^ data);
    for (i = 0; i < 8; ++i) crc = (uint8_t)((crc & 0x80) ? (crc << 1) ^ 0x07 : crc << 1);
    return crc;
}
