// Scanning a text for a sketch: core/formats.h declares these under the C library's names.
// In a file of their own: a program gets what it calls, and a board without it can be linked.
#include <cstdarg>
#include <cstdio>

#include "arduino/core/narrow_format.h"

using qduino::arduino::FormatKind;
using qduino::arduino::NarrowFormat;

extern "C" {
int qduino_vsscanf(const char* text, const char* format, std::va_list values) {
    return std::vsscanf(text, NarrowFormat(format, FormatKind::scan).text(), values);
}
int qduino_sscanf(const char* text, const char* format, ...) {
    std::va_list values;
    va_start(values, format);
    const int done = qduino_vsscanf(text, format, values);
    va_end(values);
    return done;
}
}
