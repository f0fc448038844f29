#include "board/metal/driver/firmware_tables.h"

#include <algorithm>
#include <cstring>
#include <string_view>

namespace qduino::board::metal {
namespace {

/// Tables have no alignment.
template <typename T>
T read_at(std::uint64_t address) {
    T value;
    std::memcpy(&value, reinterpret_cast<const void*>(address), sizeof value);
    return value;
}

bool has_name(std::uint64_t address, std::string_view name) {
    return std::memcmp(reinterpret_cast<const void*>(address), name.data(), name.size()) == 0;
}

/// ACPI 5.2.5.1: in the read-only memory of a BIOS, at a multiple of 16.
std::uint64_t search_rsdp() {
    for (std::uint64_t at = 0xe0000; at < 0x100000; at += 16) {
        if (has_name(at, "RSD PTR ")) return at;
    }
    return 0;
}

std::uint64_t find_table(std::uint64_t rsdp, std::string_view name) {
    constexpr int kHead = 36;
    const bool wide = read_at<std::uint8_t>(rsdp + 15) >= 2 && read_at<std::uint64_t>(rsdp + 24) != 0;
    const std::uint64_t root = wide ? read_at<std::uint64_t>(rsdp + 24) : read_at<std::uint32_t>(rsdp + 16);
    const std::uint64_t end = root + read_at<std::uint32_t>(root + 4);
    for (std::uint64_t at = root + kHead; at < end; at += wide ? 8 : 4) {
        const std::uint64_t table = wide ? read_at<std::uint64_t>(at) : read_at<std::uint32_t>(at);
        if (has_name(table, name)) return table;
    }
    return 0;
}

void take_core(ComputerTables& tables, std::uint32_t apic, std::uint32_t flags) {
    constexpr std::uint32_t kEnabled = 1, kHighest = 0xfe;
    // Firmware may have named one as both kinds of entry.
    const bool known = std::ranges::find(tables.cores, apic) != tables.cores.end();
    if ((flags & kEnabled) == 0 || apic > kHighest || known) return;
    static_cast<void>(tables.cores.try_push_back(apic));
}

LineOverride override_at(std::uint64_t entry) {
    const auto flags = read_at<std::uint16_t>(entry + 8);
    return {.line = read_at<std::uint8_t>(entry + 3),
            .input = read_at<std::uint32_t>(entry + 4),
            .active_low = (flags & 3) == 3,
            .level_triggered = (flags >> 2 & 3) == 3};
}

void take_entry(std::uint64_t entry, ComputerTables& tables) {
    switch (read_at<std::uint8_t>(entry)) {
        case 0:  // processor, local APIC
            return take_core(tables, read_at<std::uint8_t>(entry + 3), read_at<std::uint32_t>(entry + 4));
        case 9:  // processor, local x2APIC
            return take_core(tables, read_at<std::uint32_t>(entry + 4), read_at<std::uint32_t>(entry + 8));
        case 1:  // I/O APIC
            if (read_at<std::uint32_t>(entry + 8) == 0) tables.io_apic = read_at<std::uint32_t>(entry + 4);
            return;
        case 2:
            static_cast<void>(tables.overrides.try_push_back(override_at(entry)));
            return;
        default:
            return;
    }
}

/// ACPI 5.2.9: bit 5 of IAPC_BOOT_ARCH denies a CMOS clock.
void take_clock(std::uint64_t fadt, ComputerTables& tables) {
    constexpr std::uint32_t kNoClock = 1u << 5;
    tables.century = read_at<std::uint8_t>(fadt + 108);
    tables.has_cmos_clock = (read_at<std::uint16_t>(fadt + 109) & kNoClock) == 0;
}

/// Older firmware has the port itself, newer one a "generic address" of it: space 1 are ports.
std::uint16_t acpi_timer_port(std::uint64_t fadt) {
    if (const auto port = read_at<std::uint32_t>(fadt + 76); port != 0)
        return static_cast<std::uint16_t>(port);
    const bool has_port = read_at<std::uint32_t>(fadt + 4) >= 220 && read_at<std::uint8_t>(fadt + 208) == 1;
    return has_port ? static_cast<std::uint16_t>(read_at<std::uint64_t>(fadt + 212)) : std::uint16_t{0};
}

}  // namespace

Result<ComputerTables> read_firmware_tables(std::uint64_t rsdp, std::uint32_t first) {
    if (rsdp == 0) rsdp = search_rsdp();
    const std::uint64_t madt = rsdp == 0 ? 0 : find_table(rsdp, "APIC");
    if (madt == 0) return make_error(ErrorCode::not_found, "the firmware has no ACPI table of interrupts");
    ComputerTables tables;
    tables.cores.push_back(first);
    if (const std::uint64_t fadt = find_table(rsdp, "FACP"); fadt != 0) {
        tables.acpi_timer = acpi_timer_port(fadt);
        take_clock(fadt, tables);
    }
    tables.local_apic = read_at<std::uint32_t>(madt + 36);
    const std::uint64_t end = madt + read_at<std::uint32_t>(madt + 4);
    for (std::uint64_t entry = madt + 44; entry + 2 <= end;) {
        const auto length = read_at<std::uint8_t>(entry + 1);
        if (length < 2) break;
        take_entry(entry, tables);
        entry += length;
    }
    return tables;
}

}  // namespace qduino::board::metal
