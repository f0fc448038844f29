// Includes the headers of the AVR's C library by name, and uses what is in them.
#pragma once
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <util/atomic.h>
#include <util/crc16.h>
#include <util/delay.h>

uint16_t checkOf(const char* text);
unsigned long waitABit();
