/* The part of an AVR's boot loader that tells one board from another. There is no other part here:
 * the calls that write to the program's memory do not exist. (avr-libc user manual, <avr/boot.h>.)
 *
 * This file is C and C++. */
#pragma once

#include <stdint.h>

/** The three bytes of an ATmega2560 at 0, 2 and 4 (its data sheet, "Signature Bytes"); 0xff
 * elsewhere: no serial number. */
static inline uint8_t boot_signature_byte_get(uint16_t address) {
    return address == 0 ? 0x1e : address == 2 ? 0x98 : address == 4 ? 0x01 : 0xff;
}
