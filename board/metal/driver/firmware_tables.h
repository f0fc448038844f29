// What the firmware says of the computer: its cores, its interrupt controllers, and where the ISA
// interrupts arrive.
//
//   RSDP ──► XSDT or RSDT ─┬► MADT "APIC" ──► one entry for each core, I/O APIC and rerouted line
//                          └► FADT "FACP" ──► the port of ACPI's timer, the clock with the date
//
// ACPI Specification 6.5, 5.2.5 (RSDP), 5.2.7–8 (RSDT, XSDT), 5.2.9 (FADT),
// 5.2.12 (MADT). No AML is needed.
#pragma once

#include <cstdint>

#include "base/fixed_vector.h"
#include "base/result.h"
#include "board/metal/computer/core_interrupts.h"

namespace qduino::board::metal {

/// An ISA line that arrives at another input of the I/O APIC, or with another polarity.
struct LineOverride {
    std::uint8_t line = 0;
    std::uint32_t input = 0;
    bool active_low = false;
    bool level_triggered = false;
};

struct ComputerTables {
    FixedVector<std::uint32_t, kCoresMax> cores;  ///< their local APIC numbers, the first one first
    std::uint64_t local_apic = 0xfee00000;
    std::uint64_t io_apic = 0;  ///< of inputs 0…; 0: none
    FixedVector<LineOverride, 16> overrides;
    std::uint16_t acpi_timer = 0;  ///< its port; 0: none
    bool has_cmos_clock = true;    ///< the firmware does not deny it
    std::uint8_t century = 0;      ///< the CMOS clock's register that has it; 0: none
};

/// `rsdp`: where the loader says that it is; 0: it is looked for where a BIOS has it. `first`: the
/// local APIC number of the calling core. Cores beyond kCoresMax are left alone, and so
/// are those with a number beyond 254: what a device raises reaches no such core. Error: not_found.
Result<ComputerTables> read_firmware_tables(std::uint64_t rsdp, std::uint32_t first);

}  // namespace qduino::board::metal
