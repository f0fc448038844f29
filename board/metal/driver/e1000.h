// e1000: Intel's 82540EM, the network card that both QEMU and Bochs have.
//
//   receive ring    [ done | done | the card's … ]   head: the card's, tail: ours
//   transmit ring   [ done | the card's … | free ]   each entry names a buffer
//
// An entry's status says when the card is done with it. PCI/PCI-X Family of Gigabit Ethernet
// Controllers Software Developer's Manual (Intel, 317453): 3.2 (receive ring), 3.3 (transmit ring),
// 5.6 (its memory), 13.4 (registers), 14.3–14.5 (start).
#pragma once

#include "board/metal/driver/network_card.h"
#include "board/metal/driver/pci.h"

namespace qduino::board::metal {

class E1000 final : public NetworkCard {
  public:
    [[nodiscard]] bool open() override;
    [[nodiscard]] const Address& address() const override { return address_; }
    void add_to(DeviceInterrupts& interrupts, Device& device) override;
    void interrupt(bool on) override;

    [[nodiscard]] std::span<const std::uint8_t> frame() override;
    void release() override;
    [[nodiscard]] std::span<std::uint8_t> room() override;
    void send(std::size_t size) override;
    void flush() override;

  private:
    static constexpr std::uint32_t kEntries = 64;
    using Buffer = std::array<std::uint8_t, 2048>;
    struct Received {
        std::uint64_t at = 0;
        std::uint16_t size = 0, checksum = 0;
        std::uint8_t status = 0, errors = 0;
        std::uint16_t special = 0;
    };
    struct Sent {
        std::uint64_t at = 0;
        std::uint16_t size = 0;
        std::uint8_t checksum_at = 0, command = 0, status = 0, checksum_from = 0;
        std::uint16_t special = 0;
    };

    void set(std::uint32_t offset, std::uint32_t value) const { registers_.write(offset, value); }
    [[nodiscard]] std::uint32_t get(std::uint32_t offset) const {
        return registers_.read<std::uint32_t>(offset);
    }
    void reset() const;
    [[nodiscard]] bool take_address();
    void start_rings();

    Registers registers_;
    std::uint8_t line_ = 0;
    Address address_{};
    alignas(16) std::array<Received, kEntries> receive_{};
    alignas(16) std::array<Sent, kEntries> transmit_{};
    std::array<Buffer, kEntries> received_{}, sent_{};
    std::uint32_t next_received_ = 0;  // the oldest that the card has, or will have, filled
    std::uint32_t next_sent_ = 0;      // the next to fill
};

}  // namespace qduino::board::metal
