// The I/O APIC: which core an interrupt line goes to.
//
//   line of a device ─► input ─► redirection entry {vector, core, polarity, masked} ─► local APIC
//
// Intel 82093AA datasheet, 3.2. This is what noInterrupts(device, core) rewrites.
#pragma once

#include <cstdint>

#include "board/metal/computer/core_interrupts.h"
#include "board/metal/driver/firmware_tables.h"

namespace qduino::board::metal {

/// The two 8259A of old raise nothing more. Before LocalApic::enable(), which shuts their way to
/// the core: an interrupt that is under way there would arrive without a vector.
void silence_old_pic();

class IoApic final : public InterruptSource {
  public:
    /// All inputs are masked. `tables` outlives it.
    explicit IoApic(const ComputerTables& tables);

    /// ISA line `line`; `apic` is the number of a local APIC.
    void route(std::uint8_t line, std::uint8_t vector, std::uint32_t apic) override;

  private:
    void write(std::uint32_t number, std::uint32_t value) const;
    [[nodiscard]] std::uint32_t read(std::uint32_t number) const;

    const ComputerTables& tables_;
};

}  // namespace qduino::board::metal
