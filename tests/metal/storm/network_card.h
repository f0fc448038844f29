// A source of interrupts: the network card that QEMU and Bochs have (Intel 82540EM, "e1000"), which
// asks who its network's host is, and asks again as soon as it was answered.
//
//   ask() ─► card ─► network ─► answer ─► interrupt ─► top half: quiet() ─► bottom half: serve()
//              ▲                                                                      │
//              └──────────────────────────── ask() ◄──────────────────────────────────┘
//
// Registers: Intel 8254x Family of Gigabit Ethernet Controllers Software Developer's Manual,
// chapter 13. The question is an ARP request (RFC 826) for 192.168.10.1, whom Bochs plays.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "board/metal/core/device_interrupts.h"

namespace storm {

class NetworkCard final : public qduino::board::metal::Device {
  public:
    /// In setup(). False: there is none.
    bool open();
    void ask();
    [[nodiscard]] long answers() const { return answers_.load(); }

    void quiet() override;
    void serve() override;

  private:
    static constexpr std::uint32_t kSlots = 16;
    struct Descriptor {
        std::uint64_t address = 0;
        std::uint16_t length = 0;
        std::uint16_t words = 0;  // received: a sum; to send: what to do, in the upper byte
        std::atomic<std::uint8_t> done{0};
        std::array<std::uint8_t, 3> rest{};
    };
    static_assert(sizeof(Descriptor) == 16);

    [[nodiscard]] std::uint32_t get(std::uint32_t offset) const;
    void set(std::uint32_t offset, std::uint32_t value) const;
    [[nodiscard]] std::uint32_t word_of_memory(std::uint32_t number) const;
    void make_question();
    void open_rings();

    std::uint64_t registers_ = 0;
    alignas(16) std::array<Descriptor, kSlots> to_send_{};
    alignas(16) std::array<Descriptor, kSlots> received_{};
    std::array<std::array<std::uint8_t, 2048>, kSlots> frames_{};
    std::array<std::uint8_t, 64> question_{};
    std::uint32_t next_sent_ = 0;
    std::uint32_t next_received_ = 0;
    std::atomic<long> answers_{0};
};

}  // namespace storm
