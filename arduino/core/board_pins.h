/* The numbers of this board that libraries ask for in #if: how many pins, which ones the buses
 * have. Pins are numbered as on the Mega: digital 0–53, analog from 54 (A0).
 *
 * This file is C and C++. */
#pragma once

#define NUM_DIGITAL_PINS 70
#define NUM_ANALOG_INPUTS 16
#define LED_BUILTIN 13

#define PIN_SPI_SS 53
#define PIN_SPI_MOSI 51
#define PIN_SPI_MISO 50
#define PIN_SPI_SCK 52
#define PIN_WIRE_SDA 20
#define PIN_WIRE_SCL 21
#define PIN_A0 54
#define PIN_A1 55
#define PIN_A2 56
#define PIN_A3 57
#define PIN_A4 58
#define PIN_A5 59
#define PIN_A6 60
#define PIN_A7 61

/* An interrupt's number is its pin's; every pin can have one. But old sketches call the interrupts
 * of pins 2 and 3 by 0 and 1, as an Uno and a Mega do: pins 0 and 1 have others. */
#define QDUINO_INTERRUPT_OF_PIN_0 256
#ifdef __cplusplus
#define QDUINO_KNOWN constexpr int
#else
#define QDUINO_KNOWN static inline int
#endif
QDUINO_KNOWN qduino_interrupt_of_pin(int pin) {
    return pin == 0 || pin == 1 ? QDUINO_INTERRUPT_OF_PIN_0 + pin : pin;
}
#define digitalPinToInterrupt(pin) qduino_interrupt_of_pin(pin)
#define NOT_AN_INTERRUPT (-1)
#define EXTERNAL_NUM_INTERRUPTS NUM_DIGITAL_PINS
#define NOT_A_PIN 0
#define NOT_A_PORT 0
#define NOT_ON_TIMER 0
#define analogInputToDigitalPin(channel) ((channel) < NUM_ANALOG_INPUTS ? (channel) + PIN_A0 : -1)
/* The pins that have PWM on a Mega; which have it here says the board file. */
#define digitalPinHasPWM(pin) (((pin) >= 2 && (pin) <= 13) || ((pin) >= 44 && (pin) <= 46))

/* One "cycle" of TIME_UNIT(cycles) and F_CPU is a nanosecond: the seam counts time in those. */
#define F_CPU 1000000000UL
#define clockCyclesPerMicrosecond() (F_CPU / 1000000UL)
#define clockCyclesToMicroseconds(cycles) ((cycles) / clockCyclesPerMicrosecond())
#define microsecondsToClockCycles(us) ((us)*clockCyclesPerMicrosecond())

#define _BV(bit) (1 << (bit))
#define bit_is_set(value, bit) ((value)&_BV(bit))
#define bit_is_clear(value, bit) (!bit_is_set(value, bit))
