/* This file is C and C++. */
#pragma once

/** 1 when an odd number of bits of this byte is set, so that with this bit the parity is even. */
#define parity_even_bit(value) (__builtin_parity((unsigned char)(value)))
