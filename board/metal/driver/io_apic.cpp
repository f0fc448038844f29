#include "board/metal/driver/io_apic.h"

#include "board/metal/computer/instructions.h"

namespace qduino::board::metal {
namespace {

constexpr std::uint32_t kVersion = 1;
constexpr std::uint32_t kEntries = 0x10;  // two registers each
constexpr std::uint32_t kMasked = 0x10000, kLevelTriggered = 0x8000, kActiveLow = 0x2000;
constexpr std::uint32_t kDataWindow = 0x10;

}  // namespace

void silence_old_pic() {
    constexpr std::uint16_t kFirstMask = 0x21, kSecondMask = 0xa1;
    port_write(kFirstMask, 0xff);
    port_write(kSecondMask, 0xff);
}

IoApic::IoApic(const ComputerTables& tables) : tables_(tables) {
    const std::uint32_t last = read(kVersion) >> 16 & 0xff;
    for (std::uint32_t input = 0; input <= last; ++input) write(kEntries + 2 * input, kMasked);
}

void IoApic::write(std::uint32_t number, std::uint32_t value) const {
    memory_write(tables_.io_apic, number);
    memory_write(tables_.io_apic + kDataWindow, value);
}

std::uint32_t IoApic::read(std::uint32_t number) const {
    memory_write(tables_.io_apic, number);
    return memory_read(tables_.io_apic + kDataWindow);
}

void IoApic::route(std::uint8_t line, std::uint8_t vector, std::uint32_t apic) {
    LineOverride where{.line = line, .input = line};
    for (const LineOverride& known : tables_.overrides) {
        if (known.line == line) where = known;
    }
    const std::uint32_t entry = kEntries + 2 * where.input;
    write(entry, kMasked);  // never to the new core with the old vector
    write(entry + 1, apic << 24);
    write(entry,
          vector | (where.active_low ? kActiveLow : 0) | (where.level_triggered ? kLevelTriggered : 0));
}

}  // namespace qduino::board::metal
