#include "board/metal/core/context.h"

#include <cstring>

namespace qduino::board::metal {

void Context::begin(void (*entry)(void*), void* argument, std::uint64_t top) {
    constexpr std::uint16_t kControl = 0x37f;         // of the x87: all exceptions masked
    constexpr std::uint32_t kVectorControl = 0x1f80;  // MXCSR: the same
    constexpr std::uint64_t kCode = 0x08, kData = 0x10, kInterruptsOn = 0x202;
    Frame& start = frame();
    start = {};
    std::memcpy(start.floating_point.data(), &kControl, sizeof kControl);
    std::memcpy(start.floating_point.data() + 24, &kVectorControl, sizeof kVectorControl);
    start.rip = reinterpret_cast<std::uint64_t>(entry);
    start.registers[Frame::kFirstArgument] = reinterpret_cast<std::uint64_t>(argument);
    start.cs = kCode;
    start.ss = kData;
    start.flags = kInterruptsOn;
    start.rsp = top - 8;  // as if called
}

}  // namespace qduino::board::metal
