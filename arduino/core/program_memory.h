// PROGMEM and its readers: on this board data in "flash" is ordinary constant memory.
#pragma once

#include <cstdint>
#include <cstring>

#define PROGMEM
#define PGM_P const char*
#define PGM_VOID_P const void*

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

inline std::uint8_t pgm_read_byte(const void* address) { return *static_cast<const std::uint8_t*>(address); }
/// 16 bits, as on the AVR.
inline std::uint16_t pgm_read_word(const void* address) {
    return qduino::arduino::value_at<std::uint16_t>(address);
}
inline std::uint32_t pgm_read_dword(const void* address) {
    return qduino::arduino::value_at<std::uint32_t>(address);
}
/// A table of texts is read with these on the AVR, where an address has 16 bits; here an address is
/// an address.
template <typename T>
std::uintptr_t pgm_read_word(T* const* address) {
    return reinterpret_cast<std::uintptr_t>(*address);
}
template <typename T>
std::uintptr_t pgm_read_dword(T* const* address) {
    return reinterpret_cast<std::uintptr_t>(*address);
}
inline float pgm_read_float(const void* address) { return qduino::arduino::value_at<float>(address); }
inline void* pgm_read_ptr(const void* address) { return qduino::arduino::value_at<void*>(address); }
inline std::uint8_t pgm_read_byte_near(const void* address) { return pgm_read_byte(address); }
inline std::uint16_t pgm_read_word_near(const void* address) { return pgm_read_word(address); }
inline std::uint32_t pgm_read_dword_near(const void* address) { return pgm_read_dword(address); }
inline float pgm_read_float_near(const void* address) { return pgm_read_float(address); }

inline std::size_t strlen_P(const char* text) { return std::strlen(text); }
inline char* strcpy_P(char* to, const char* from) { return std::strcpy(to, from); }
inline char* strncpy_P(char* to, const char* from, std::size_t size) {
    if (size > 0) {
        std::memset(to, 0, size);
        std::memcpy(to, from, strnlen(from, size));
    }
    return to;
}
inline char* strcat_P(char* to, const char* from) { return std::strcat(to, from); }
inline int strcmp_P(const char* a, const char* b) { return std::strcmp(a, b); }
inline int strncmp_P(const char* a, const char* b, std::size_t size) { return std::strncmp(a, b, size); }
inline void* memcpy_P(void* to, const void* from, std::size_t size) { return std::memcpy(to, from, size); }
#define sprintf_P sprintf
#define snprintf_P snprintf
