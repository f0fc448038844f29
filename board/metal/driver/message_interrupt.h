// MSI-X: a device interrupts a core by a store to that core's address.
//
//   device ── {vector} to 0xFEE00000 | core ──► local APIC            no line, no I/O APIC
//                └─ an entry in a table of the device, which may be masked
//
// What comes while the entry is masked is remembered, and interrupts when it is not any more. PCI
// Local Bus Specification 3.0, 6.8.2; Intel SDM volume 3, 11.11 (the message).
#pragma once

#include <cstdint>

#include "board/metal/computer/core_interrupts.h"
#include "board/metal/computer/spin_lock.h"
#include "board/metal/driver/pci.h"

namespace qduino::board::metal {

class MessageInterrupt final : public InterruptSource {
  public:
    /// Entry 0 of the device's table, masked. False: the device has no MSI-X.
    [[nodiscard]] bool open(const PciDevice& device);
    /// It has no line; `apic` is the number of a local APIC.
    void route(std::uint8_t line, std::uint8_t vector, std::uint32_t apic) override;
    void mask(bool masked);

  private:
    Registers entry_;
    bool masked_ = true;
    SpinLock lock_;
};

}  // namespace qduino::board::metal
