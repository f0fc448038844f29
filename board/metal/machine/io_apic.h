// The I/O APIC: which core an interrupt line goes to.
//
//   line of a device ─► input ─► redirection entry {vector, core, polarity, masked} ─► local APIC
//
// Intel 82093AA datasheet, 3.2. This is what noInterrupts(device, core) rewrites.
#pragma once

#include <cstdint>

#include "board/metal/machine/firmware_tables.h"

namespace qduino::board::metal {

/// The two 8259A of old raise nothing more. Before LocalApic::enable(), which shuts their way to
/// the core: an interrupt that is under way there would arrive without a vector.
void silence_old_pic();

class IoApic {
  public:
    /// All inputs are masked. `machine` outlives it.
    explicit IoApic(const Machine& machine);
    /// The machine's, when it has been made.
    static IoApic* of_machine() { return of_machine_; }

    /// ISA line `line` raises `vector` on the core with this local APIC number, from now on.
    void route(std::uint8_t line, std::uint8_t vector, std::uint32_t apic);

  private:
    void write(std::uint32_t number, std::uint32_t value) const;
    [[nodiscard]] std::uint32_t read(std::uint32_t number) const;

    const Machine& machine_;
    inline static constinit IoApic* of_machine_ = nullptr;
};

}  // namespace qduino::board::metal
