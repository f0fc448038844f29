// Makes its own reader of flash before it includes Arduino.h, as displays' drivers do.
#ifndef __AVR__
#define pgm_read_byte(address) (*(const unsigned char*)(address))
#define pgm_read_word(address) (*(const unsigned short*)(address))
#define PROGMEM
#endif

#include "OwnReader.h"

#include <Arduino.h>

static const unsigned short words[] PROGMEM = {100, 200, 300};
static const unsigned char bytes[] PROGMEM = {1, 2, 3};

int readTable(int index) { return pgm_read_word(&words[index]) + pgm_read_byte(&bytes[index]); }
