// Ports of 32 bits, which drivers of a PC's devices use.
#pragma once

#include <cstdint>

namespace qduino::board::metal {

inline void port_write_word(std::uint16_t port, std::uint32_t value) {
    asm volatile("outl %0, %1" : : "a"(value), "Nd"(port));
}
inline std::uint32_t port_read_word(std::uint16_t port) {
    std::uint32_t value = 0;
    asm volatile("inl %1, %0" : "=a"(value) : "Nd"(port));
    return value;
}

}  // namespace qduino::board::metal
