/* PROGMEM and its readers: on this board data in "flash" is ordinary constant memory.
 *
 * A library may have made a reader of its own before it includes this (Adafruit's do, where the
 * processor is no AVR). Then its reader stays.
 *
 * This file is C and C++. */
#pragma once

#ifdef __cplusplus
#include <cstdint>
#include <cstring>
#endif
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <strings.h>

#ifndef PROGMEM
#define PROGMEM
#endif
#ifndef PGM_P
#define PGM_P const char*
#endif
#ifndef PGM_VOID_P
#define PGM_VOID_P const void*
#endif
#ifndef PSTR
#define PSTR(text) (text)
#endif

#ifdef __cplusplus

using prog_char = char;
using prog_uchar = unsigned char;

namespace qduino::arduino {
/// The bytes at `address`, which may not be aligned.
template <typename T>
T value_at(const void* address) {
    T value;
    std::memcpy(&value, address, sizeof value);
    return value;
}
}  // namespace qduino::arduino

#ifndef pgm_read_byte
inline std::uint8_t pgm_read_byte(const void* address) { return *static_cast<const std::uint8_t*>(address); }
#endif
#ifndef pgm_read_word
/// 16 bits, as on the AVR.
inline std::uint16_t pgm_read_word(const void* address) {
    return qduino::arduino::value_at<std::uint16_t>(address);
}
/// A table of texts is read with these on the AVR, where an address has 16 bits; here an address is
/// an address.
template <typename T>
std::uintptr_t pgm_read_word(T* const* address) {
    return reinterpret_cast<std::uintptr_t>(*address);
}
#endif
#ifndef pgm_read_dword
inline std::uint32_t pgm_read_dword(const void* address) {
    return qduino::arduino::value_at<std::uint32_t>(address);
}
template <typename T>
std::uintptr_t pgm_read_dword(T* const* address) {
    return reinterpret_cast<std::uintptr_t>(*address);
}
#endif
#ifndef pgm_read_float
inline float pgm_read_float(const void* address) { return qduino::arduino::value_at<float>(address); }
#endif
#ifndef pgm_read_ptr
inline void* pgm_read_ptr(const void* address) { return qduino::arduino::value_at<void*>(address); }
#endif

#else

#ifndef pgm_read_byte
#define pgm_read_byte(address) (*(const uint8_t*)(address))
#endif
#ifndef pgm_read_word
#define pgm_read_word(address) (*(const uint16_t*)(address))
#endif
#ifndef pgm_read_dword
#define pgm_read_dword(address) (*(const uint32_t*)(address))
#endif
#ifndef pgm_read_float
#define pgm_read_float(address) (*(const float*)(address))
#endif
#ifndef pgm_read_ptr
#define pgm_read_ptr(address) (*(void* const*)(address))
#endif

#endif

#ifndef pgm_read_byte_near
#define pgm_read_byte_near(address) pgm_read_byte(address)
#define pgm_read_word_near(address) pgm_read_word(address)
#define pgm_read_dword_near(address) pgm_read_dword(address)
#define pgm_read_float_near(address) pgm_read_float(address)
#define pgm_read_ptr_near(address) pgm_read_ptr(address)
#endif

/* By hand: g++ warns of the C library's, which may leave its target without an end. */
static inline char* strncpy_P(char* to, const char* from, size_t size) {
    if (size > 0) {
        memset(to, 0, size);
        memcpy(to, from, strnlen(from, size));
    }
    return to;
}
static inline size_t strlen_P(const char* text) { return strlen(text); }
static inline char* strcpy_P(char* to, const char* from) { return strcpy(to, from); }
static inline char* strcat_P(char* to, const char* from) { return strcat(to, from); }
static inline int strcmp_P(const char* a, const char* b) { return strcmp(a, b); }
static inline int strncmp_P(const char* a, const char* b, size_t size) { return strncmp(a, b, size); }
static inline int strcasecmp_P(const char* a, const char* b) { return strcasecmp(a, b); }
static inline int strncasecmp_P(const char* a, const char* b, size_t size) { return strncasecmp(a, b, size); }
static inline void* memcpy_P(void* to, const void* from, size_t size) { return memcpy(to, from, size); }
static inline int memcmp_P(const void* a, const void* b, size_t size) { return memcmp(a, b, size); }
#define strstr_P strstr
#define strchr_P strchr
#define strlcpy_P strlcpy
#define strlcat_P strlcat
#define printf_P printf
#define fprintf_P fprintf
#define sprintf_P sprintf
#define snprintf_P snprintf
#define vsnprintf_P vsnprintf
