#include "board/metal/driver/e1000.h"

#include <atomic>
#include <cstring>

namespace qduino::board::metal {
namespace {

// Registers.
constexpr std::uint32_t kControl = 0x0000, kMemoryRead = 0x0014, kCause = 0x00c0, kMaskSet = 0x00d0,
                        kMaskClear = 0x00d8, kReceiveControl = 0x0100, kTransmitControl = 0x0400,
                        kGap = 0x0410, kReceiveRing = 0x2800, kTransmitRing = 0x3800, kMulticast = 0x5200,
                        kAddress = 0x5400;
// The registers of a ring, from its first on.
constexpr std::uint32_t kRingLow = 0x00, kRingHigh = 0x04, kRingBytes = 0x08, kRingHead = 0x10,
                        kRingTail = 0x18;

/// The bit of an entry's status that says that the card is done with it.
constexpr std::uint8_t kDone = 0x01;
/// Interrupts of the receiver.
constexpr std::uint32_t kOnTimer = 0x80, kOnFew = 0x10, kOnOverrun = 0x40;

/// The card writes it meanwhile.
bool is_done(std::uint8_t& status) {
    return (std::atomic_ref(status).load(std::memory_order_acquire) & kDone) != 0;
}

}  // namespace

bool E1000::open() {
    constexpr std::uint16_t kIntel = 0x8086, k82540 = 0x100e;
    const auto device = PciDevice::find(kIntel, k82540);
    if (!device || !interrupt_lines) return false;
    device->enable(true);
    registers_ = device->registers(0);
    line_ = device->line();
    if (!registers_.exist()) return false;
    reset();
    if (!take_address()) return false;
    start_rings();
    return true;
}

void E1000::reset() const {
    constexpr std::uint32_t kReset = 1u << 26, kLinkUp = 1u << 6;
    set(kMaskClear, 0xffff'ffff);
    set(kControl, get(kControl) | kReset);
    for (int looks = 0; (get(kControl) & kReset) != 0 && looks < 1'000'000;) ++looks;
    set(kMaskClear, 0xffff'ffff);
    static_cast<void>(get(kCause));  // to read it clears it
    set(kControl, get(kControl) | kLinkUp);
    for (std::uint32_t i = 0; i < 128; ++i) set(kMulticast + 4 * i, 0);
}

/// The first three words of the card's memory (5.6.1, 13.4.4). A card may have loaded them into its
/// receiver's filter at the reset. Bochs' has not, and would take no frame for its address.
bool E1000::take_address() {
    constexpr std::uint32_t kStart = 0x01, kReady = 0x10, kValid = 1u << 31;
    for (std::uint32_t word = 0; word < address_.size() / 2; ++word) {
        set(kMemoryRead, word << 8 | kStart);
        for (int looks = 0; (get(kMemoryRead) & kReady) == 0;) {
            if (++looks == 1'000'000) return false;
        }
        const std::uint32_t bytes = get(kMemoryRead) >> 16;
        address_[2 * word] = static_cast<std::uint8_t>(bytes);
        address_[2 * word + 1] = static_cast<std::uint8_t>(bytes >> 8);
    }
    std::array<std::uint32_t, 2> filter{};
    std::memcpy(filter.data(), address_.data(), address_.size());
    set(kAddress, filter[0]);
    set(kAddress + 4, filter[1] | kValid);
    return true;
}

void E1000::start_rings() {
    const auto start = [this](std::uint32_t ring, const void* entries, std::uint32_t bytes,
                              std::uint32_t tail) {
        const auto at = reinterpret_cast<std::uint64_t>(entries);
        set(ring + kRingLow, static_cast<std::uint32_t>(at));
        set(ring + kRingHigh, static_cast<std::uint32_t>(at >> 32));
        set(ring + kRingBytes, bytes);
        set(ring + kRingHead, 0);
        set(ring + kRingTail, tail);
    };
    for (std::uint32_t i = 0; i < kEntries; ++i) {
        receive_[i].at = reinterpret_cast<std::uint64_t>(received_[i].data());
        transmit_[i].at = reinterpret_cast<std::uint64_t>(sent_[i].data());
        transmit_[i].status = kDone;
    }
    // The card's are those from the head up to the tail: of the receive ring all but one.
    start(kReceiveRing, receive_.data(), sizeof receive_, kEntries - 1);
    start(kTransmitRing, transmit_.data(), sizeof transmit_, 0);
    // Transmitter on, short frames padded; the gaps are the manual's for copper (13.4.34).
    constexpr std::uint32_t kOn = 0x2, kPad = 0x8, kCollisions = 0xf << 4 | 0x40 << 12,
                            kGaps = 10 | 8 << 10 | 6 << 20;
    set(kGap, kGaps);
    set(kTransmitControl, kOn | kPad | kCollisions);
    constexpr std::uint32_t kBroadcast = 1u << 15,
                            kWithoutChecksum = 1u << 26;  // buffers of 2048 bytes are 0
    set(kReceiveControl, kOn | kBroadcast | kWithoutChecksum);
}

void E1000::add_to(DeviceInterrupts& interrupts, Device& device) {
    interrupts.add(*interrupt_lines, DeviceClass::nic, line_, device);
}

void E1000::interrupt(bool on) {
    if (on) return set(kMaskSet, kOnTimer | kOnFew | kOnOverrun);
    set(kMaskClear, 0xffff'ffff);
    static_cast<void>(get(kCause));  // and its line is released
}

std::span<const std::uint8_t> E1000::frame() {
    constexpr std::uint8_t kWhole = 0x02;  // the frame ends in this buffer
    for (;;) {
        Received& entry = receive_[next_received_];
        if (!is_done(entry.status)) return {};
        if ((entry.status & kWhole) != 0 && entry.errors == 0 && entry.size <= sizeof(Buffer))
            return {received_[next_received_].data(), entry.size};
        release();
    }
}

void E1000::release() {
    receive_[next_received_].status = 0;
    std::atomic_thread_fence(std::memory_order_release);
    set(kReceiveRing + kRingTail, next_received_);
    next_received_ = (next_received_ + 1) % kEntries;
}

std::span<std::uint8_t> E1000::room() {
    if (!is_done(transmit_[next_sent_].status)) return {};
    return sent_[next_sent_];
}

void E1000::send(std::size_t size) {
    constexpr std::uint8_t kEnd = 0x01, kChecksum = 0x02, kReport = 0x08;
    Sent& entry = transmit_[next_sent_];
    entry.size = static_cast<std::uint16_t>(size);
    entry.command = kEnd | kChecksum | kReport;
    entry.status = 0;
    next_sent_ = (next_sent_ + 1) % kEntries;
}

void E1000::flush() {
    std::atomic_thread_fence(std::memory_order_release);
    set(kTransmitRing + kRingTail, next_sent_);
}

}  // namespace qduino::board::metal
