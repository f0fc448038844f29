// B0 … B11111111: the language's binary constants. (0b… is the standard's own, and better.)
#pragma once

// Each step appends one more digit to `name`, whose digits so far have the value `value`.
#define QDUINO_BITS_1(name, value) name##0 = 2 * (value), name##1 = 2 * (value) + 1
#define QDUINO_BITS_2(name, value) \
    QDUINO_BITS_1(name, value), QDUINO_BITS_1(name##0, 2 * (value)), QDUINO_BITS_1(name##1, 2 * (value) + 1)
#define QDUINO_BITS_3(name, value) \
    QDUINO_BITS_1(name, value), QDUINO_BITS_2(name##0, 2 * (value)), QDUINO_BITS_2(name##1, 2 * (value) + 1)
#define QDUINO_BITS_4(name, value) \
    QDUINO_BITS_1(name, value), QDUINO_BITS_3(name##0, 2 * (value)), QDUINO_BITS_3(name##1, 2 * (value) + 1)
#define QDUINO_BITS_5(name, value) \
    QDUINO_BITS_1(name, value), QDUINO_BITS_4(name##0, 2 * (value)), QDUINO_BITS_4(name##1, 2 * (value) + 1)
#define QDUINO_BITS_6(name, value) \
    QDUINO_BITS_1(name, value), QDUINO_BITS_5(name##0, 2 * (value)), QDUINO_BITS_5(name##1, 2 * (value) + 1)
#define QDUINO_BITS_7(name, value) \
    QDUINO_BITS_1(name, value), QDUINO_BITS_6(name##0, 2 * (value)), QDUINO_BITS_6(name##1, 2 * (value) + 1)
#define QDUINO_BITS_8(name, value) \
    QDUINO_BITS_1(name, value), QDUINO_BITS_7(name##0, 2 * (value)), QDUINO_BITS_7(name##1, 2 * (value) + 1)

enum BinaryConstant : int { QDUINO_BITS_8(B, 0) };
