#include "board/metal/computer/processor.h"

#include <cstring>

extern "C" void system_call_entry();  // x86/entry.S

namespace qduino::board::metal {

void Frame::begin(void (*entry)(void*), void* argument, std::uint64_t top) {
    constexpr std::uint16_t kControl = 0x37f;         // of the x87: all exceptions masked
    constexpr std::uint32_t kVectorControl = 0x1f80;  // MXCSR: the same
    constexpr std::uint64_t kCode = 0x08, kData = 0x10, kInterruptsOn = 0x202;
    *this = {};
    std::memcpy(floating_point.data(), &kControl, sizeof kControl);
    std::memcpy(floating_point.data() + 24, &kVectorControl, sizeof kVectorControl);
    rip = reinterpret_cast<std::uint64_t>(entry);
    registers[kFirstArgument] = reinterpret_cast<std::uint64_t>(argument);
    cs = kCode;
    ss = kData;
    flags = kInterruptsOn;
    rsp = top - 8;  // as if called
}

/// The C library's calls: Intel SDM volume 3, 5.8.8.
void Processor::open(void* core) {
    constexpr std::uint32_t kStar = 0xc0000081, kLongStar = 0xc0000082, kFlagMask = 0xc0000084;
    constexpr std::uint64_t kSelectors = 0x08;  // code; data is the next
    core_ = core;
    msr_write(kGsBase, reinterpret_cast<std::uint64_t>(this));
    descriptors_.load();
    msr_write(kStar, kSelectors << 32);
    msr_write(kLongStar, reinterpret_cast<std::uint64_t>(&system_call_entry));
    msr_write(kFlagMask, 0);
}

bool is_about_memory(const Frame& frame, std::uint64_t& address) {
    constexpr std::uint64_t kPageFault = 14;
    if (frame.vector != kPageFault) return false;
    asm volatile("movq %%cr2, %0" : "=r"(address));
    return true;
}

/// Intel SDM volume 3, table 6-1.
std::string_view exception_name(const Frame& frame) {
    std::string_view names =
        "divide error|debug exception|non-maskable interrupt|breakpoint|overflow|bound exceeded|"
        "invalid opcode|no coprocessor|double fault|coprocessor overrun|invalid task state|"
        "segment not present|stack fault|general protection|page fault|reserved|floating-point error|"
        "alignment check|machine check|vector floating-point error|exception";
    for (std::uint64_t vector = frame.vector; vector > 0 && names.find('|') < names.size(); --vector)
        names.remove_prefix(names.find('|') + 1);
    return names.substr(0, names.find('|'));
}

}  // namespace qduino::board::metal
