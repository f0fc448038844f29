/* The C library's formats for a sketch whose `long` has 32 bits.
 *
 * `%ld` means a number of 64 bits to the C library of a 64-bit Linux, and the sketch gives it 32.
 * A compiler sees that where the format stands in the call. But a format travels: through a
 * function of the sketch's that takes `const char* format, ...`, in a variable, in a table. Then
 * printf() reads what lies behind the number, and scanf() writes over it. So in a sketch these
 * names are calls of functions of this board, which know what an `l` means there.
 *
 * Included before every header of the system: a name that was declared before keeps its function.
 *
 * This file is C and C++. */
#pragma once

#if defined(QDUINO_LONG_32)
#ifdef __cplusplus
#define QDUINO_NOTHROW noexcept(true)
extern "C" {
#else
#define QDUINO_NOTHROW
#endif

struct _IO_FILE;
#define QDUINO_FOR_SKETCH(name) __asm__("qduino_" #name)
int printf(const char* __restrict format, ...) QDUINO_FOR_SKETCH(printf);
int fprintf(struct _IO_FILE* __restrict file, const char* __restrict format, ...) QDUINO_FOR_SKETCH(fprintf);
int vprintf(const char* __restrict format, __builtin_va_list values) QDUINO_FOR_SKETCH(vprintf);
int vfprintf(struct _IO_FILE* __restrict file, const char* __restrict format, __builtin_va_list values)
    QDUINO_FOR_SKETCH(vfprintf);
int sprintf(char* __restrict text, const char* __restrict format, ...) QDUINO_NOTHROW
    QDUINO_FOR_SKETCH(sprintf);
int vsprintf(char* __restrict text, const char* __restrict format, __builtin_va_list values) QDUINO_NOTHROW
    QDUINO_FOR_SKETCH(vsprintf);
int snprintf(char* __restrict text, __SIZE_TYPE__ size, const char* __restrict format, ...) QDUINO_NOTHROW
    QDUINO_FOR_SKETCH(snprintf);
int vsnprintf(char* __restrict text, __SIZE_TYPE__ size, const char* __restrict format,
              __builtin_va_list values) QDUINO_NOTHROW QDUINO_FOR_SKETCH(vsnprintf);
int scanf(const char* __restrict format, ...) QDUINO_FOR_SKETCH(scanf);
int fscanf(struct _IO_FILE* __restrict file, const char* __restrict format, ...) QDUINO_FOR_SKETCH(fscanf);
int vscanf(const char* __restrict format, __builtin_va_list values) QDUINO_FOR_SKETCH(vscanf);
int vfscanf(struct _IO_FILE* __restrict file, const char* __restrict format, __builtin_va_list values)
    QDUINO_FOR_SKETCH(vfscanf);
int sscanf(const char* __restrict text, const char* __restrict format, ...) QDUINO_NOTHROW
    QDUINO_FOR_SKETCH(sscanf);
int vsscanf(const char* __restrict text, const char* __restrict format,
            __builtin_va_list values) QDUINO_NOTHROW QDUINO_FOR_SKETCH(vsscanf);

#ifdef __cplusplus
}
#endif
#endif
