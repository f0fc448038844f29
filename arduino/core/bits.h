/* Bits of any place that can be assigned to: a variable, a bit-field, PORTB.
 *
 * This file is C and C++. */
#pragma once

#define bitSet(value, index) ((value) |= (1ULL << (index)))
#define bitClear(value, index) ((value) &= ~(1ULL << (index)))
#define bitToggle(value, index) ((value) ^= (1ULL << (index)))
#define bitWrite(value, index, level) ((level) ? bitSet(value, index) : bitClear(value, index))
