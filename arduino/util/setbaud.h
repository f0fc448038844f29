/* The divisor of an AVR's UART for BAUD, at the 16 MHz of an Uno or Mega. No register takes it:
 * Serial1.begin(BAUD) does. BAUD may change later. (avr-libc user manual, <util/setbaud.h>.) */
#pragma once

#define USE_2X 0
#define UBRR_VALUE ((16000000UL + 8UL * (BAUD)) / (16UL * (BAUD)) - 1UL)
#define UBRRL_VALUE (UBRR_VALUE & 0xff)
#define UBRRH_VALUE (UBRR_VALUE >> 8)
