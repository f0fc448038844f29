/* An AVR's fuses, which the Arduino IDE does not write either: a sketch may state them in vain.
 *
 * This file is C and C++. */
#pragma once

typedef struct {
    unsigned char low, high, extended;
} __fuse_t;

#define FUSES static const __fuse_t __fuse __attribute__((unused))
#define LFUSE_DEFAULT 0xff
#define HFUSE_DEFAULT 0xff
#define EFUSE_DEFAULT 0xff
