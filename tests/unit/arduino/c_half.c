/* The language as C has it: its words and calls, for avr_test.cpp to compare with C++'s. */
#include "arduino/Arduino.h"
#include "arduino/avr/io.h"
#include "arduino/avr/pgmspace.h"
#include "arduino/util/crc16.h"
#include "arduino/util/delay.h"

const double c_words[] = {LOW,      HIGH,    CHANGE,   FALLING,  RISING,     INPUT,      OUTPUT,        INPUT_PULLUP, INPUT_PULLDOWN,
                          LSBFIRST, MSBFIRST, DEC,      HEX,      OCT,        BIN,        PI,            HALF_PI,      TWO_PI,
                          EULER,    DEFAULT, EXTERNAL, INTERNAL, DEG_TO_RAD, RAD_TO_DEG, OUTPUT_OPENDRAIN,
                          A0,       A1,      A2,       A3,       A4,         A5,         A6,            A7,
                          SS,       MOSI,    MISO,     SCK,      SDA,        SCL,        LED_BUILTIN,   NUM_DIGITAL_PINS};
const unsigned c_word_count = sizeof c_words / sizeof c_words[0];

static const uint16_t table[] PROGMEM = {1, 2, 300};

/* Drives `pin` high for 5 ms and reads it, all in C. */
unsigned long c_half_works(int pin);
unsigned long c_half_works(int pin) {
    const unsigned long began = micros();
    boolean high = HIGH;
    int bits = 0;
    pinMode(pin, OUTPUT);
    digitalWrite(pin, high);
    _delay_ms(2);
    delay(3);
    digitalWrite(pin, LOW);
    bitSet(bits, 3);
    return micros() - began + pgm_read_word(&table[2]) + constrain(bits, 0, 7) + max(1, 2);
}
