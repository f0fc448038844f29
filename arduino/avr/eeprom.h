/* avr-libc's way to the EEPROM: the bytes that EEPROM.h has. An address is a pointer whose number
 * is the byte's, or that of a variable that is declared EEMEM. (avr-libc user manual,
 * <avr/eeprom.h>.)
 *
 *   uint16_t EEMEM starts;                    somewhere from byte 0 on, in the order of the linker
 *   eeprom_update_word(&starts, 7);
 *   eeprom_read_byte((const uint8_t*)100);
 *
 * What stands behind the EEPROM reads as 0xff. An EEMEM variable's initial value is not written, as
 * on an Arduino.
 *
 * This file is C and C++. */
#pragma once

#include <stddef.h>
#include <stdint.h>

#define EEMEM __attribute__((section("qduino_eeprom"), used))

#ifdef __cplusplus
extern "C" {
#endif
/* The linker's names for both ends of EEMEM. */
extern uint8_t __start_qduino_eeprom[] __attribute__((weak, visibility("hidden")));
extern uint8_t __stop_qduino_eeprom[] __attribute__((weak, visibility("hidden")));
uint8_t qduino_eeprom_read(size_t index);
void qduino_eeprom_write(size_t index, uint8_t value);
#ifdef __cplusplus
}
#endif

static inline size_t qduino_eeprom_index(const void* address) {
    const uintptr_t at = (uintptr_t)address, first = (uintptr_t)__start_qduino_eeprom;
    return at >= first && at < (uintptr_t)__stop_qduino_eeprom ? at - first : at;
}

static inline void eeprom_read_block(void* to, const void* from, size_t size) {
    const size_t index = qduino_eeprom_index(from);
    size_t i;
    for (i = 0; i < size; ++i) ((uint8_t*)to)[i] = qduino_eeprom_read(index + i);
}
static inline void eeprom_write_block(const void* from, void* to, size_t size) {
    const size_t index = qduino_eeprom_index(to);
    size_t i;
    for (i = 0; i < size; ++i) qduino_eeprom_write(index + i, ((const uint8_t*)from)[i]);
}
static inline void eeprom_update_block(const void* from, void* to, size_t size) {
    eeprom_write_block(from, to, size);
}

#define QDUINO_EEPROM_OF(name, type)                                     \
    static inline type eeprom_read_##name(const type* address) {         \
        type value;                                                      \
        eeprom_read_block(&value, address, sizeof value);                \
        return value;                                                    \
    }                                                                    \
    static inline void eeprom_write_##name(type* address, type value) {  \
        eeprom_write_block(&value, address, sizeof value);               \
    }                                                                    \
    static inline void eeprom_update_##name(type* address, type value) { \
        eeprom_write_block(&value, address, sizeof value);               \
    }
QDUINO_EEPROM_OF(byte, uint8_t)
QDUINO_EEPROM_OF(word, uint16_t)
QDUINO_EEPROM_OF(dword, uint32_t)
QDUINO_EEPROM_OF(float, float)
#undef QDUINO_EEPROM_OF

#define eeprom_is_ready() 1
#define eeprom_busy_wait() \
    do {                   \
    } while (0)
