// Printing into a text for a sketch: core/formats.h declares these under the C library's names.
// In a file of their own: a program gets what it calls, and a board without it can be linked.
#include <cstdarg>
#include <cstdio>

#include "arduino/core/narrow_format.h"

using qduino::arduino::FormatKind;
using qduino::arduino::NarrowFormat;

extern "C" {
int qduino_vsnprintf(char* text, std::size_t size, const char* format, std::va_list values) {
    return std::vsnprintf(text, size, NarrowFormat(format, FormatKind::print).text(), values);
}
int qduino_vsprintf(char* text, const char* format, std::va_list values) {
    return std::vsprintf(text, NarrowFormat(format, FormatKind::print).text(), values);
}
int qduino_snprintf(char* text, std::size_t size, const char* format, ...) {
    std::va_list values;
    va_start(values, format);
    const int done = qduino_vsnprintf(text, size, format, values);
    va_end(values);
    return done;
}
int qduino_sprintf(char* text, const char* format, ...) {
    std::va_list values;
    va_start(values, format);
    const int done = qduino_vsprintf(text, format, values);
    va_end(values);
    return done;
}
}
