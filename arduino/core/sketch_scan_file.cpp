// Scanning a file for a sketch: core/formats.h declares these under the C library's names.
// In a file of their own: a program gets what it calls, and a board without it can be linked.
#include <cstdarg>
#include <cstdio>

#include "arduino/core/narrow_format.h"

using qduino::arduino::FormatKind;
using qduino::arduino::NarrowFormat;

extern "C" {
int qduino_vfscanf(std::FILE* file, const char* format, std::va_list values) {
    return std::vfscanf(file, NarrowFormat(format, FormatKind::scan).text(), values);
}
int qduino_vscanf(const char* format, std::va_list values) {
    return std::vscanf(NarrowFormat(format, FormatKind::scan).text(), values);
}
int qduino_fscanf(std::FILE* file, const char* format, ...) {
    std::va_list values;
    va_start(values, format);
    const int done = qduino_vfscanf(file, format, values);
    va_end(values);
    return done;
}
int qduino_scanf(const char* format, ...) {
    std::va_list values;
    va_start(values, format);
    const int done = qduino_vscanf(format, values);
    va_end(values);
    return done;
}
}
