// virtio-net: the network card of virtual machines, and the simplest there is.
//
//   wire ─► receive queue:  64 buffers offered ─► used, with a frame in each ─► offered again
//   wire ◄─ transmit queue: offered with a frame in it ─► used ─► free
//
// A frame has a head of 12 bytes in its buffer, which says nothing here. VIRTIO 1.1: 3.1.1 (start
// of a device), 4.1 (on PCI), 5.1 (network device).
#pragma once

#include "base/fixed_vector.h"
#include "board/metal/driver/message_interrupt.h"
#include "board/metal/driver/network_card.h"
#include "board/metal/driver/pci.h"
#include "board/metal/driver/virtqueue.h"

namespace qduino::board::metal {

class VirtioNet final : public NetworkCard {
  public:
    [[nodiscard]] bool open() override;
    [[nodiscard]] const Address& address() const override { return address_; }
    void add_to(DeviceInterrupts& interrupts, Device& device) override {
        interrupts.add(message_, DeviceClass::nic, 0, device);
    }
    void interrupt(bool on) override;

    [[nodiscard]] std::span<const std::uint8_t> frame() override;
    void release() override;
    [[nodiscard]] std::span<std::uint8_t> room() override;
    void send(std::size_t size) override;
    void flush() override;

  private:
    static constexpr std::size_t kHead = 12;
    using Buffer = std::array<std::uint8_t, 2048>;
    enum Queue : std::uint16_t { kReceive = 0, kTransmit = 1 };

    [[nodiscard]] bool find_parts(const PciDevice& device);
    [[nodiscard]] bool agree();
    void start_queue(Queue number, const Virtqueue& queue, std::uint16_t entry);
    void tell(Queue number) const;

    Registers common_, notify_, own_;
    std::uint32_t notify_step_ = 0;
    std::array<std::uint32_t, 2> notify_at_{};
    MessageInterrupt message_;
    Address address_{};

    Virtqueue receive_, transmit_;
    std::array<Buffer, Virtqueue::kSize> received_{}, sent_{};
    FixedVector<std::uint16_t, Virtqueue::kSize> free_;  // of sent_
    bool offered_ = false;                               // buffers that the card was not told of
    bool queued_ = false;                                // the same of frames
};

}  // namespace qduino::board::metal
