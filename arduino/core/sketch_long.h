/* `long` as a sketch has it. Headers of this board are read by the compiler itself, to which a
 * `long` has 64 bits; a sketch's own text has 32 (QDUINO_LONG_32: tools/ino/as_arduino.py).
 *
 * This file is C and C++. */
#pragma once

#include <stdint.h>

#if defined(QDUINO_LONG_32)
typedef int32_t qduino_long;
typedef uint32_t qduino_unsigned_long;
#else
typedef long qduino_long;
typedef unsigned long qduino_unsigned_long;
#endif
