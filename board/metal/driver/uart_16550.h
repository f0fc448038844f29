// A 16550 UART. PC16550D datasheet (National Semiconductor): registers, and FIFOs of 16 bytes.
#pragma once

#include <cstdint>

#include "board/metal/computer/instructions.h"

namespace qduino::board::metal {

class Uart16550 {
  public:
    static constexpr std::uint8_t kFirstLine = 4, kSecondLine = 3;  ///< ISA interrupts
    static constexpr int kFifoBytes = 16;

    /// There is none.
    constexpr Uart16550() = default;
    static constexpr Uart16550 first() { return Uart16550(0x3f8); }
    static constexpr Uart16550 second() { return Uart16550(0x2f8); }

    /// 115,200 baud, 8N1, FIFOs on, no interrupts. False: there is no UART.
    [[nodiscard]] bool open() const {
        constexpr std::uint8_t kDivisorAccess = 0x80, k8N1 = 0x03, kFifosOn = 0xc7, kReady = 0x0b,
                               kTest = 0x5a;
        set(kScratch, kTest);
        if (get(kScratch) != kTest) return false;
        set(kEnable, 0);
        set(kFormat, kDivisorAccess);
        set(kData, 1);  // 115,200 baud
        set(kEnable, 0);
        set(kFormat, k8N1);
        set(kFifos, kFifosOn);
        set(kModem, kReady);  // and the gate of its interrupt
        return true;
    }
    [[nodiscard]] bool exists() const { return port_ != 0; }
    /// True: it will interrupt, at once where it is empty now.
    [[nodiscard]] bool interrupt_on(bool data, bool empty) const {
        constexpr std::uint8_t kOnData = 0x01, kOnEmpty = 0x02;
        set(kEnable, static_cast<std::uint8_t>((data ? kOnData : 0) | (empty ? kOnEmpty : 0)));
        return true;
    }
    /// What interrupted ends by being served.
    void acknowledge() const {}
    [[nodiscard]] bool has_byte() const { return (get(kState) & 0x01) != 0; }
    [[nodiscard]] std::uint8_t take() const { return get(kData); }
    [[nodiscard]] bool transmitter_empty() const { return (get(kState) & 0x20) != 0; }
    void put(std::uint8_t byte) const { set(kData, byte); }
    [[nodiscard]] bool all_sent() const { return (get(kState) & 0x40) != 0; }

  private:
    // Registers, from the port on.
    static constexpr std::uint16_t kData = 0, kEnable = 1, kFifos = 2, kFormat = 3, kModem = 4, kState = 5,
                                   kScratch = 7;

    constexpr explicit Uart16550(std::uint16_t port) : port_(port) {}
    void set(std::uint16_t offset, std::uint8_t value) const {
        port_write(static_cast<std::uint16_t>(port_ + offset), value);
    }
    [[nodiscard]] std::uint8_t get(std::uint16_t offset) const {
        return port_read(static_cast<std::uint16_t>(port_ + offset));
    }

    std::uint16_t port_ = 0;
};

}  // namespace qduino::board::metal
