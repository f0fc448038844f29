// A PC's clock that runs without power: an MC146818, or what has its registers since. It tells the
// date once, when the computer begins.
//
//   register   0 seconds   2 minutes   4 hours   7 day   8 month   9 year of its century
//   10         bit 7       it counts on now, or will within 244 us: nothing is to be read
//   11         bit 2       numbers are binary; else each half of a byte is a decimal digit
//              bit 1       24 hours; else they are 12, and bit 7 of register 4 says p.m.
//   13         bit 7       the battery has held; bit 6 is always 0
//
// The difficulty: it counts on by itself between two reads, and 23:59:59 read in two halves is a
// day off. So all registers are read when it has just said that it rests, and once more: two equal
// readings are one instant.
//
// Facts: MC146818A (Motorola, 1984), "Address Map", "Update Cycle", "Registers"; which register has
// the century, and whether there is a clock: ACPI Specification 6.5, 5.2.9 (CENTURY,
// IAPC_BOOT_ARCH).
#pragma once

#include <cstdint>
#include <optional>

namespace qduino::board::metal {

/// Reads a register by its number.
using ReadCmos = std::uint8_t (*)(std::uint8_t number);

/// Seconds since 1970, where the clock keeps UTC. `century`: the number of the register that has
/// it; 0: none has, and the year is one of 2000…2099. Nothing: no clock answers, its battery was
/// empty, or what it says is no date. Takes up to 5 ms, 50 where no clock answers.
[[nodiscard]] std::optional<std::int64_t> read_cmos_date(ReadCmos read, std::uint8_t century);

}  // namespace qduino::board::metal
