#include "board/metal/driver/message_interrupt.h"

namespace qduino::board::metal {
namespace {

// The words of an entry, in bytes from its start.
constexpr std::uint32_t kAddress = 0, kAddressHigh = 4, kData = 8, kControl = 12;

}  // namespace

bool MessageInterrupt::open(const PciDevice& device) {
    constexpr std::uint8_t kMsix = 0x11;
    constexpr std::uint32_t kEnable = 0x8000'0000, kAllMasked = 0x4000'0000;
    const std::uint8_t at = device.capability(kMsix);
    if (at == 0) return false;
    const std::uint32_t table = device.read(static_cast<std::uint8_t>(at + 4));
    const Registers bar = device.registers(table & 7);
    if (!bar.exist()) return false;
    entry_ = bar.from(table & ~7u);
    entry_.write<std::uint32_t>(kControl, 1);
    device.write(at, (device.read(at) | kEnable) & ~kAllMasked);
    return true;
}

void MessageInterrupt::route(std::uint8_t, std::uint8_t vector, std::uint32_t apic) {
    constexpr std::uint32_t kLocalApics = 0xfee0'0000;
    const SpinGuard held(lock_);
    entry_.write<std::uint32_t>(kControl, 1);  // never to the new core with the old vector
    entry_.write<std::uint32_t>(kAddress, kLocalApics | apic << 12);
    entry_.write<std::uint32_t>(kAddressHigh, 0);
    entry_.write<std::uint32_t>(kData, vector);
    entry_.write<std::uint32_t>(kControl, masked_ ? 1 : 0);
}

void MessageInterrupt::mask(bool masked) {
    const SpinGuard held(lock_);
    masked_ = masked;
    entry_.write<std::uint32_t>(kControl, masked ? 1 : 0);
}

}  // namespace qduino::board::metal
