// A PL011 UART. PrimeCell UART (PL011) Technical Reference Manual (Arm DDI 0183G), chapter 3, and
// its FIFOs of 16 bytes.
#pragma once

#include <cstdint>

#include "board/metal/computer/instructions.h"

namespace qduino::board::metal {

class Pl011 {
  public:
    static constexpr int kFifoBytes = 16;

    /// There is none.
    constexpr Pl011() = default;
    static constexpr Pl011 first() { return Pl011(true); }
    /// The firmware tells where the first one is; there is no second.
    static void place_first(std::uint64_t address) { address_of_first_ = address; }
    static constexpr Pl011 second() { return {}; }

    /// 8N1, FIFOs on, no interrupts; the rate is the firmware's. False: there is no UART.
    [[nodiscard]] bool open() const {
        constexpr std::uint32_t k8BitsFifos = 0x70, kAll = 0x7ff, kBothWays = 0x301;
        if (!exists()) return false;
        set(kControl, 0);
        set(kMask, 0);
        set(kClear, kAll);
        set(kFormat, k8BitsFifos);
        set(kControl, kBothWays);
        return true;
    }
    [[nodiscard]] bool exists() const { return is_first_ && address_of_first_ != 0; }
    /// False: it will not interrupt for `empty` though it is. That interrupt comes when the FIFO
    /// falls to its mark, and nothing was in it yet.
    [[nodiscard]] bool interrupt_on(bool data, bool empty) const {
        set(kMask, (data ? kReceived : 0) | (empty ? kTransmitted : 0));
        return !empty || (get(kRaw) & kTransmitted) != 0 || !transmitter_empty();
    }
    /// That of the transmitter stays: it ends with the next byte that is more than the mark.
    void acknowledge() const { set(kClear, kReceived); }
    [[nodiscard]] bool has_byte() const { return (get(kState) & 0x10) == 0; }
    [[nodiscard]] std::uint8_t take() const { return static_cast<std::uint8_t>(get(kData)); }
    [[nodiscard]] bool transmitter_empty() const { return (get(kState) & 0x80) != 0; }
    void put(std::uint8_t byte) const { set(kData, byte); }
    [[nodiscard]] bool all_sent() const { return (get(kState) & 0x08) == 0; }

  private:
    // Registers, by their offset.
    static constexpr std::uint32_t kData = 0x00, kState = 0x18, kFormat = 0x2c, kControl = 0x30, kMask = 0x38,
                                   kRaw = 0x3c, kClear = 0x44;
    static constexpr std::uint32_t kReceived = 0x50, kTransmitted = 0x20;  // with the time-out

    constexpr explicit Pl011(bool is_first) : is_first_(is_first) {}
    static void set(std::uint32_t offset, std::uint32_t value) {
        memory_write(address_of_first_ + offset, value);
    }
    [[nodiscard]] static std::uint32_t get(std::uint32_t offset) {
        return memory_read(address_of_first_ + offset);
    }

    inline static constinit std::uint64_t address_of_first_ = 0;
    bool is_first_ = false;
};

}  // namespace qduino::board::metal
