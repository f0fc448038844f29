#include "board/metal/x86/descriptors.h"

extern "C" std::uint8_t interrupt_stubs[];  // x86/entry.S: 16 bytes each

namespace qduino::board::metal {
namespace {

constexpr std::uint64_t kCode = 0x00af9a000000ffff;
constexpr std::uint64_t kData = 0x00cf92000000ffff;
constexpr std::uint16_t kCodeSelector = 0x08;
constexpr std::uint16_t kTaskSelector = 0x18;

struct [[gnu::packed]] TableAt {
    std::uint16_t limit;
    std::uint64_t address;
};

struct Gate {
    std::uint64_t low = 0;
    std::uint64_t high = 0;
};

constexpr Gate gate(std::uint64_t handler, std::uint64_t stack) {
    constexpr std::uint64_t kInterruptGate = 0x8e00;  // present, ring 0, interrupts off
    return {.low = (handler & 0xffff) | std::uint64_t{kCodeSelector} << 16 | stack << 32 |
                   kInterruptGate << 32 | (handler >> 16 & 0xffff) << 48,
            .high = handler >> 32};
}

alignas(16) constinit std::array<Gate, 256> gates{};

}  // namespace

void Descriptors::load() {
    constexpr std::size_t kExceptions = 32;
    for (std::size_t i = 0; i < gates.size(); ++i)  // each core writes the same
        gates[i] = gate(reinterpret_cast<std::uint64_t>(interrupt_stubs) + 16 * i, i < kExceptions ? 2 : 1);
    task_.interrupt_stacks[1] = reinterpret_cast<std::uint64_t>(panic_stack_.data() + kPanicStack);

    const auto task = reinterpret_cast<std::uint64_t>(&task_);
    constexpr std::uint64_t kAvailableTask = 0x89;
    segments_ = {
        0, kCode, kData,
        (sizeof(TaskState) - 1) | (task & 0xffffff) << 16 | kAvailableTask << 40 | (task >> 24 & 0xff) << 56,
        task >> 32};
    const TableAt segments{sizeof segments_ - 1, reinterpret_cast<std::uint64_t>(segments_.data())};
    const TableAt interrupts{sizeof gates - 1, reinterpret_cast<std::uint64_t>(gates.data())};
    // Code and data selectors are as at boot, so nothing has to be loaded again.
    asm volatile("lgdt %0\n\tlidt %1\n\tltr %2"
                 :
                 : "m"(segments), "m"(interrupts), "r"(kTaskSelector)
                 : "memory");
}

}  // namespace qduino::board::metal
