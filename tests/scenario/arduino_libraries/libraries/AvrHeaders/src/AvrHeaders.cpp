#include "AvrHeaders.h"

static volatile uint16_t shared = 0;

uint16_t checkOf(const char* text) {
    uint16_t crc = 0xffff;
    while (pgm_read_byte(text)) crc = _crc16_update(crc, pgm_read_byte(text++));
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { shared = crc; }
    uint8_t before = SREG;
    cli();
    crc = shared;
    SREG = before;
    return crc;
}

unsigned long waitABit() {
    wdt_enable(WDTO_8S);
    const unsigned long began = micros();
    _delay_ms(2);
    _delay_us(500);
    set_sleep_mode(SLEEP_MODE_IDLE);
    sleep_mode();
    wdt_reset();
    wdt_disable();
    return micros() - began;
}
