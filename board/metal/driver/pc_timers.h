// The timers that every PC has besides those of its cores. They tell how fast a core's counter is.
//
//   CPUID 15h     the processor says it: a crystal's rate, and a ratio. Many do not.
//   PIT           1.193182 MHz, since 1981. A firmware may have stopped its clock.
//   ACPI's timer  3.579545 MHz, at the port that the firmware's tables name.
//
// The first that answers is taken. A port without a device reads as ones, so a timer answers when
// its count is seen to change.
// Intel SDM volume 3, 18.7.3 (CPUID 15h); Intel 8254 datasheet; ACPI Specification 6.5, 4.8.2.1.
#pragma once

#include <cstdint>

namespace qduino::board::metal {

/// Ticks a second of this core's counter, with interrupts off; 0: nothing tells. `acpi_timer`: the
/// port, 0 where there is none. Takes 50 ms.
[[nodiscard]] std::uint64_t clock_rate(std::uint16_t acpi_timer);

/// Channel 0 of the PIT comes round every `us`, whose interrupt is masked.
void repeat_pit(double us);

}  // namespace qduino::board::metal
