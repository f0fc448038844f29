/* What avr-libc has beyond the C library here: numbers as text in any base, and copies of bounded
 * length. (avr-libc user manual, <stdlib.h> and <string.h>.)
 *
 * This file is C and C++. */
#pragma once

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

/** Writes `value` in `base` (2…36) with small letters; `text` holds 33 bytes at least. Returns it.
 * Another base gives an empty text. */
static inline char* utoa(unsigned int value, char* text, int base) {
    char digits[33];
    int count = 0;
    int i;
    text[0] = '\0';
    if (base < 2 || base > 36) return text;
    do {
        const unsigned digit = value % (unsigned)base;
        digits[count++] = (char)(digit < 10 ? '0' + digit : 'a' + digit - 10);
        value /= (unsigned)base;
    } while (value != 0);
    for (i = 0; i < count; ++i) text[i] = digits[count - 1 - i];
    text[count] = '\0';
    return text;
}
/** The same; base 10 has a minus sign, others are two's complement of 32 bits, as on the AVR. */
static inline char* itoa(int value, char* text, int base) {
    if (base != 10 || value >= 0) return utoa((unsigned)value, text, base);
    text[0] = '-';
    utoa(0u - (unsigned)value, text + 1, base);
    return text;
}
/** A `long` of the AVR has 32 bits: what is longer is cut off, as there. */
static inline char* ultoa(unsigned long value, char* text, int base) {
    return utoa((unsigned)value, text, base);
}
static inline char* ltoa(long value, char* text, int base) { return itoa((int)value, text, base); }

/** `value` with `decimals` digits behind the point, `width` characters at least: to the right, or
 * with a negative width to the left. */
static inline char* dtostrf(double value, signed char width, unsigned char decimals, char* text) {
    sprintf(text, "%*.*f", width, decimals, value);
    return text;
}

#if defined(__GLIBC__) && !__GLIBC_PREREQ(2, 38)
/** Copies at most `size` − 1 characters and ends them; returns the length of `from`. */
static inline size_t strlcpy(char* to, const char* from, size_t size) {
    const size_t length = strlen(from);
    if (size > 0) {
        const size_t count = length < size ? length : size - 1;
        memcpy(to, from, count);
        to[count] = '\0';
    }
    return length;
}
/** Appends so that `to` has at most `size` − 1 characters; returns the length it wanted to have. */
static inline size_t strlcat(char* to, const char* from, size_t size) {
    const size_t before = strnlen(to, size);
    return before == size ? size + strlen(from) : before + strlcpy(to + before, from, size - before);
}
#endif
