/* <stdint.h> for a sketch whose `long` has 32 bits: the system's, but a constant of 64 bits is a
 * `long long`, as on every Arduino. The system writes it with the suffix of its own `long`. */
#pragma once

#include_next <stdint.h>

#if defined(QDUINO_LONG_32) && !defined(QDUINO_STDINT_H)
#define QDUINO_STDINT_H
#undef INT64_C
#undef UINT64_C
#undef INTMAX_C
#undef UINTMAX_C
#define INT64_C(value) value##LL
#define UINT64_C(value) value##ULL
#define INTMAX_C(value) value##LL
#define UINTMAX_C(value) value##ULL
#endif
