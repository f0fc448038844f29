// Printing to a file for a sketch: core/formats.h declares these under the C library's names.
// In a file of their own: a program gets what it calls, and a board without it can be linked.
#include <cstdarg>
#include <cstdio>

#include "arduino/core/narrow_format.h"

using qduino::arduino::FormatKind;
using qduino::arduino::NarrowFormat;

extern "C" {
int qduino_vfprintf(std::FILE* file, const char* format, std::va_list values) {
    return std::vfprintf(file, NarrowFormat(format, FormatKind::print).text(), values);
}
int qduino_vprintf(const char* format, std::va_list values) {
    return std::vprintf(NarrowFormat(format, FormatKind::print).text(), values);
}
int qduino_fprintf(std::FILE* file, const char* format, ...) {
    std::va_list values;
    va_start(values, format);
    const int done = qduino_vfprintf(file, format, values);
    va_end(values);
    return done;
}
int qduino_printf(const char* format, ...) {
    std::va_list values;
    va_start(values, format);
    const int done = qduino_vprintf(format, values);
    va_end(values);
    return done;
}
}
