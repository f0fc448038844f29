#include "network_card.h"

#include <algorithm>

#include "board/metal/machine/instructions.h"

namespace storm {
namespace {

using namespace qduino::board::metal;

constexpr std::uint32_t kControl = 0x0, kMemoryOfCard = 0x14, kCause = 0xc0, kAllow = 0xd0, kForbid = 0xd8,
                        kReceive = 0x100, kSend = 0x400, kReceivedAt = 0x2800, kSentAt = 0x3800;
// Of a ring, from the register with its address on.
constexpr std::uint32_t kAddressHigh = 4, kSize = 8, kHead = 0x10, kTail = 0x18;
constexpr std::uint32_t kReceiveCauses = 0x80 | 0x40 | 0x10;  // a frame; lost ones; few slots left

void port_write_long(std::uint16_t port, std::uint32_t value) {
    asm volatile("outl %0, %1" : : "a"(value), "Nd"(port));
}
std::uint32_t port_read_long(std::uint16_t port) {
    std::uint32_t value = 0;
    asm volatile("inl %1, %0" : "=a"(value) : "Nd"(port));
    return value;
}

/// A device's configuration space, by the old ports (PCI Local Bus Specification 3.0, 3.2.2.3.2).
struct PciDevice {
    std::uint32_t number = 0;  // on bus 0

    void select(std::uint32_t offset) const { port_write_long(0xcf8, 0x80000000u | number << 11 | offset); }
    [[nodiscard]] std::uint32_t get(std::uint32_t offset) const {
        select(offset);
        return port_read_long(0xcfc);
    }
    void set(std::uint32_t offset, std::uint32_t value) const {
        select(offset);
        port_write_long(0xcfc, value);
    }
};

}  // namespace

std::uint32_t NetworkCard::get(std::uint32_t offset) const { return memory_read(registers_ + offset); }
void NetworkCard::set(std::uint32_t offset, std::uint32_t value) const {
    memory_write(registers_ + offset, value);
}

bool NetworkCard::open() {
    constexpr std::uint32_t kCard = 0x100e8086, kCommand = 4, kMemory = 0x10, kLine = 0x3c;
    PciDevice device;
    while (device.number < 32 && device.get(0) != kCard) ++device.number;
    if (device.number == 32) return false;
    device.set(kCommand, device.get(kCommand) | 6);  // its registers; it writes memory
    registers_ = device.get(kMemory) & ~15u;
    constexpr std::uint32_t kReset = 1u << 26, kLinkUp = 0x40;
    set(kControl, get(kControl) | kReset);
    for (int i = 0; i < 1000; ++i) static_cast<void>(port_read(0x80));  // about a microsecond each
    set(kForbid, ~0u);
    set(kControl, get(kControl) | kLinkUp);
    make_question();
    open_rings();
    device_interrupts.add(*IoApic::of_machine(), qduino::board::DeviceClass::nic,
                          static_cast<std::uint8_t>(device.get(kLine)), *this);
    static_cast<void>(get(kCause));  // reading clears it
    set(kAllow, kReceiveCauses);
    return true;
}

/// Its first three words are the card's address.
std::uint32_t NetworkCard::word_of_memory(std::uint32_t number) const {
    constexpr std::uint32_t kStart = 1, kDone = 0x10;
    set(kMemoryOfCard, number << 8 | kStart);
    while ((get(kMemoryOfCard) & kDone) == 0) spin_hint();
    return get(kMemoryOfCard) >> 16;
}

void NetworkCard::make_question() {
    std::array<std::uint8_t, 6> own{};
    for (std::uint32_t i = 0; i < own.size(); ++i)
        own[i] = static_cast<std::uint8_t>(word_of_memory(i / 2) >> 8 * (i % 2));
    auto at = std::fill_n(question_.begin(), 6, std::uint8_t{0xff});  // to everybody
    at = std::copy(own.begin(), own.end(), at);
    constexpr std::array<std::uint8_t, 10> kRequest{8, 6, 0, 1, 8, 0, 6, 4, 0, 1};
    at = std::copy(kRequest.begin(), kRequest.end(), at);
    at = std::copy(own.begin(), own.end(), at);
    constexpr std::array<std::uint8_t, 14> kWho{192, 168, 10, 15, 0, 0, 0, 0, 0, 0, 192, 168, 10, 1};
    std::copy(kWho.begin(), kWho.end(), at);
}

void NetworkCard::open_rings() {
    const auto address_of = [](const auto& object) { return reinterpret_cast<std::uint64_t>(&object); };
    for (std::uint32_t i = 0; i < kSlots; ++i) {
        to_send_[i].address = address_of(question_);
        to_send_[i].length = question_.size();
        to_send_[i].words = 0x0b00;  // the whole frame; add its sum; say when it is sent
        received_[i].address = address_of(frames_[i]);
    }
    for (const auto& [at, ring] : {std::pair{kReceivedAt, &received_}, std::pair{kSentAt, &to_send_}}) {
        set(at, static_cast<std::uint32_t>(address_of(*ring)));
        set(at + kAddressHigh, 0);
        set(at + kSize, sizeof *ring);
        set(at + kHead, 0);
        set(at + kTail, at == kReceivedAt ? kSlots - 1 : 0);
    }
    set(kSend, 0x4010a);        // on; short frames are filled up
    set(kReceive, 0x0400801a);  // on; frames for anybody; without their sums
}

void NetworkCard::ask() {
    const InterruptsOff off;
    next_sent_ = (next_sent_ + 1) % kSlots;
    set(kSentAt + kTail, next_sent_);
}

void NetworkCard::quiet() { set(kForbid, ~0u); }

void NetworkCard::serve() {
    static_cast<void>(get(kCause));
    for (Descriptor* slot = &received_[next_received_]; slot->done.load() != 0;
         slot = &received_[next_received_]) {
        slot->done.store(0);
        set(kReceivedAt + kTail, next_received_);
        next_received_ = (next_received_ + 1) % kSlots;
        answers_.fetch_add(1);
        ask();
    }
    set(kAllow, kReceiveCauses);
}

}  // namespace storm
