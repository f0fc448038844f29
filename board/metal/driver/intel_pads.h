// Pads of two Intel systems on a chip. Untested on silicon: no emulator has them.
//
//   Bay Trail (the paper's board)   pin n is GPIO_S0_SC[n], 0 to 101; its registers are where a
//                                   table has them, 16 bytes each: setup (+0), value (+8)
//   Apollo Lake                     pin n is pad n of one community; 8 bytes each: setup (+0),
//                                   pull (+4)
//
// A pad has registers of its own, so a write of one pin needs no lock against others. On Bay Trail
// it does: an access may be lost that meets one of another core (Linux, commit 39ce8150a079), so
// there is one at a time, and what was written is read back.
//
// Facts: Linux's drivers pinctrl-baytrail, pinctrl-intel and pinctrl-broxton; coreboot's headers
// for the two chips.
#pragma once

#include <cstdint>

#include "board/metal/driver/pin_port.h"

namespace qduino::board::metal {

/// How a word goes to a register of the computer, and comes from it.
struct MemoryAccess {
    void (*write)(std::uint64_t address, std::uint32_t value);
    std::uint32_t (*read)(std::uint64_t address);
};

class BayTrailPads final : public PinPort {
  public:
    static constexpr std::uint16_t kPins = 102;

    /// `at`: the I/O controller's registers.
    constexpr BayTrailPads(MemoryAccess memory, std::uint64_t at) : memory_(memory), at_(at) {}

    [[nodiscard]] Result<void> set_mode(PinId pin, PinMode mode, Level level) override;
    void write(PinId pin, Level level) override;
    [[nodiscard]] Level read(PinId pin) override;

  private:
    [[nodiscard]] std::uint64_t registers_of(PinId pin) const;
    /// `value` into a register, of which `mask` is looked at again.
    void put(std::uint64_t address, std::uint32_t value, std::uint32_t mask) const;
    [[nodiscard]] std::uint32_t get(std::uint64_t address) const;

    MemoryAccess memory_;
    std::uint64_t at_;
    PortLock lock_;
};

class ApolloLakePads final : public PinPort {
  public:
    /// `at`: the registers of a community that has so many pads.
    constexpr ApolloLakePads(MemoryAccess memory, std::uint64_t at, std::uint16_t pads)
        : memory_(memory), at_(at), pads_(pads) {}

    [[nodiscard]] Result<void> set_mode(PinId pin, PinMode mode, Level level) override;
    void write(PinId pin, Level level) override;
    [[nodiscard]] Level read(PinId pin) override;

  private:
    [[nodiscard]] std::uint64_t registers_of(PinId pin) const;
    [[nodiscard]] bool is_ours(PinId pin) const;

    MemoryAccess memory_;
    std::uint64_t at_;
    std::uint16_t pads_;
    PortLock lock_;
};

}  // namespace qduino::board::metal
