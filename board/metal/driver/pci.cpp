#include "board/metal/driver/pci.h"

#include "board/metal/driver/wide_ports.h"
#include "board/metal/linux_side.h"

namespace qduino::board::metal {
namespace {

constexpr std::uint16_t kAddressPort = 0xcf8, kDataPort = 0xcfc;
constexpr std::uint8_t kIdentity = 0x00, kCommand = 0x04, kHeaderType = 0x0c, kBaseAddresses = 0x10,
                       kBuses = 0x18, kCapabilities = 0x34;
constexpr std::uint32_t kNobody = 0xffff'ffff;

void select(std::uint32_t word) { port_write_word(kAddressPort, word); }

}  // namespace

std::uint32_t PciDevice::read(std::uint8_t offset) const {
    select(place_ | offset);
    return port_read_word(kDataPort);
}

void PciDevice::write(std::uint8_t offset, std::uint32_t value) const {
    select(place_ | offset);
    port_write_word(kDataPort, value);
}

std::optional<PciDevice> PciDevice::find(std::uint16_t vendor, std::uint16_t device) {
    if (linux_side.exists()) return {};  // they are all Linux's
    return find_on(0, std::uint32_t{device} << 16 | vendor);
}

/// A bridge has a bus behind it, whose number is higher.
std::optional<PciDevice> PciDevice::find_on(std::uint32_t bus, std::uint32_t identity) {
    constexpr std::uint32_t kEnable = 0x8000'0000, kBridge = 1, kManyFunctions = 0x80;
    for (std::uint32_t slot = 0; slot < 32; ++slot) {
        std::uint32_t functions = 1;
        for (std::uint32_t function = 0; function < functions; ++function) {
            const PciDevice device(kEnable | bus << 16 | slot << 11 | function << 8);
            const std::uint32_t found = device.read(kIdentity);
            if (found == identity) return device;
            if (found == kNobody) continue;
            const std::uint32_t type = device.read(kHeaderType) >> 16 & 0xff;
            if ((type & kManyFunctions) != 0) functions = 8;
            if ((type & ~kManyFunctions) != kBridge) continue;
            const std::uint32_t behind = device.read(kBuses) >> 8 & 0xff;
            if (behind <= bus) continue;
            if (const auto further = find_on(behind, identity)) return further;
        }
    }
    return std::nullopt;
}

void PciDevice::enable(bool line) const {
    constexpr std::uint32_t kMemory = 0x2, kMaster = 0x4, kNoLine = 0x400;
    const std::uint32_t before = read(kCommand) & 0xffff & ~kNoLine;
    write(kCommand, before | kMemory | kMaster | (line ? 0 : kNoLine));
}

Registers PciDevice::registers(std::uint32_t number) const {
    constexpr std::uint32_t kInPorts = 1, kWide = 4, kKinds = 0xf;
    const auto at = static_cast<std::uint8_t>(kBaseAddresses + 4 * number);
    const std::uint32_t low = read(at);
    if (number > 5 || (low & kInPorts) != 0) return {};
    if ((low & kWide) != 0 && read(static_cast<std::uint8_t>(at + 4)) != 0) return {};
    return Registers(low & ~kKinds);
}

std::uint8_t PciDevice::capability(std::uint8_t id, std::uint8_t after) const {
    constexpr int kMost = 48;  // as many as there is room for: a list that is a ring ends as well
    auto at = static_cast<std::uint8_t>(after == 0 ? read(kCapabilities) & 0xfc : read(after) >> 8 & 0xfc);
    for (int i = 0; i < kMost && at != 0; ++i) {
        const std::uint32_t head = read(at);
        if ((head & 0xff) == id) return at;
        at = static_cast<std::uint8_t>(head >> 8 & 0xfc);
    }
    return 0;
}

}  // namespace qduino::board::metal
