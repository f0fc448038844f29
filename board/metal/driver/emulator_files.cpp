#include "board/metal/driver/emulator_files.h"

#include <cstdint>

#include "board/metal/computer/instructions.h"

namespace qduino::board::metal {
namespace {

constexpr std::uint16_t kSelector = 0x510, kData = 0x511;
constexpr std::uint16_t kSignature = 0, kList = 0x19;
constexpr std::size_t kNameBytes = 56;

void select(std::uint16_t file) { asm volatile("outw %0, %1" : : "a"(file), "d"(kSelector)); }

std::string next_bytes(std::size_t count) {
    std::string bytes(count, '\0');
    for (char& byte : bytes) byte = static_cast<char>(port_read(kData));
    return bytes;
}

/// The highest byte first.
std::uint32_t next_number(int bytes) {
    std::uint32_t number = 0;
    for (int i = 0; i < bytes; ++i) number = number << 8 | port_read(kData);
    return number;
}

struct Entry {
    std::uint32_t size;
    std::uint16_t file;
    std::string name;
};

std::vector<Entry> entries() {
    select(kSignature);
    if (next_bytes(4) != "QEMU") return {};
    select(kList);
    std::vector<Entry> list(next_number(4));
    for (Entry& entry : list) {
        entry.size = next_number(4);
        entry.file = static_cast<std::uint16_t>(next_number(2));
        next_number(2);  // reserved
        const std::string name = next_bytes(kNameBytes);
        entry.name = name.substr(0, name.find('\0'));
    }
    return list;
}

}  // namespace

std::vector<EmulatorFile> emulator_files(std::string_view prefix) {
    std::vector<EmulatorFile> files;
    for (const Entry& entry : entries()) {
        if (!entry.name.starts_with(prefix)) continue;
        select(entry.file);
        files.push_back(
            {entry.name.substr(prefix.size()), std::make_shared<const std::string>(next_bytes(entry.size))});
    }
    return files;
}

}  // namespace qduino::board::metal
