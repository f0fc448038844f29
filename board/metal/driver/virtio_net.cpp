#include "board/metal/driver/virtio_net.h"

namespace qduino::board::metal {
namespace {

// The common configuration's registers, 4.1.4.3.
constexpr std::uint32_t kFeaturePart = 0x00, kFeatures = 0x04, kAcceptedPart = 0x08, kAccepted = 0x0c,
                        kConfigurationEntry = 0x10, kStatus = 0x14, kQueue = 0x16, kQueueSize = 0x18,
                        kQueueEntry = 0x1a, kQueueEnable = 0x1c, kQueueNotify = 0x1e,
                        kQueueDescriptors = 0x20, kQueueAvailable = 0x28, kQueueUsed = 0x30;
constexpr std::uint16_t kNoEntry = 0xffff;

// kStatus, 2.1.
constexpr std::uint8_t kAcknowledge = 1, kDriver = 2, kDriverOk = 4, kFeaturesOk = 8;

/// Features by their numbers: that of a device of version 1, and that it has an address.
constexpr std::uint32_t kVersion1 = 32, kHasAddress = 5;

void write_wide(const Registers& registers, std::uint32_t offset, std::uint64_t value) {
    registers.write(offset, static_cast<std::uint32_t>(value));
    registers.write(offset + 4, static_cast<std::uint32_t>(value >> 32));
}

}  // namespace

bool VirtioNet::open() {
    constexpr std::uint16_t kVendor = 0x1af4, kModern = 0x1041, kTransitional = 0x1000;
    auto device = PciDevice::find(kVendor, kModern);
    if (!device) device = PciDevice::find(kVendor, kTransitional);
    if (!device) return false;
    device->enable(false);
    if (!find_parts(*device) || !message_.open(*device) || !agree()) return false;
    for (std::uint32_t i = 0; i < address_.size(); ++i) address_[i] = own_.read<std::uint8_t>(i);
    for (std::uint16_t id = 0; id < Virtqueue::kSize; ++id) {
        receive_.set_buffer(id, received_[id].data(), sizeof(Buffer), Virtqueue::Direction::from_device);
        transmit_.set_buffer(id, sent_[id].data(), sizeof(Buffer), Virtqueue::Direction::to_device);
        receive_.offer(id);
        free_.push_back(id);
    }
    transmit_.want_interrupts(false);
    common_.write(kConfigurationEntry, kNoEntry);
    start_queue(kReceive, receive_, 0);
    start_queue(kTransmit, transmit_, kNoEntry);
    common_.write<std::uint8_t>(kStatus, kAcknowledge | kDriver | kFeaturesOk | kDriverOk);
    tell(kReceive);
    return true;
}

/// 4.1.4: capabilities of the vendor's kind say where each part of the registers is.
bool VirtioNet::find_parts(const PciDevice& device) {
    constexpr std::uint8_t kVendorsOwn = 9;
    constexpr std::uint8_t kCommonPart = 1, kNotifyPart = 2, kDevicePart = 4;
    for (std::uint8_t at = 0; (at = device.capability(kVendorsOwn, at)) != 0;) {
        const auto word = [&](std::uint32_t offset) {
            return device.read(static_cast<std::uint8_t>(at + offset));
        };
        const auto part = static_cast<std::uint8_t>(word(0) >> 24);
        Registers* const wanted = part == kCommonPart   ? &common_
                                  : part == kNotifyPart ? &notify_
                                  : part == kDevicePart ? &own_
                                                        : nullptr;
        if (!wanted || wanted->exist()) continue;  // the first of a kind is the device's favourite
        const Registers bar = device.registers(word(4) & 0xff);
        if (!bar.exist()) continue;
        *wanted = bar.from(word(8));
        if (part == kNotifyPart) notify_step_ = word(16);
    }
    return common_.exist() && notify_.exist() && own_.exist();
}

/// 3.1.1, up to the features. False: it is not a device of version 1.
bool VirtioNet::agree() {
    common_.write<std::uint8_t>(kStatus, 0);
    for (int looks = 0; common_.read<std::uint8_t>(kStatus) != 0;) {
        if (++looks == 1'000'000) return false;
    }
    common_.write<std::uint8_t>(kStatus, kAcknowledge | kDriver);
    for (std::uint32_t part = 0; part < 2; ++part) {
        common_.write(kFeaturePart, part);
        const std::uint32_t wanted = part == 0 ? 1u << kHasAddress : 1u << (kVersion1 - 32);
        const std::uint32_t offered = common_.read<std::uint32_t>(kFeatures);
        if ((offered & wanted) != wanted) return false;
        common_.write(kAcceptedPart, part);
        common_.write(kAccepted, wanted);
    }
    common_.write<std::uint8_t>(kStatus, kAcknowledge | kDriver | kFeaturesOk);
    return (common_.read<std::uint8_t>(kStatus) & kFeaturesOk) != 0;
}

void VirtioNet::start_queue(Queue number, const Virtqueue& queue, std::uint16_t entry) {
    common_.write<std::uint16_t>(kQueue, number);
    common_.write(kQueueSize, Virtqueue::kSize);
    common_.write(kQueueEntry, entry);
    write_wide(common_, kQueueDescriptors, queue.descriptors_at());
    write_wide(common_, kQueueAvailable, queue.available_at());
    write_wide(common_, kQueueUsed, queue.used_at());
    notify_at_[number] = common_.read<std::uint16_t>(kQueueNotify) * notify_step_;
    common_.write<std::uint16_t>(kQueueEnable, 1);
}

void VirtioNet::tell(Queue number) const {
    std::atomic_thread_fence(std::memory_order_seq_cst);
    notify_.write<std::uint16_t>(notify_at_[number], number);
}

void VirtioNet::interrupt(bool on) {
    receive_.want_interrupts(on);
    message_.mask(!on);
}

std::span<const std::uint8_t> VirtioNet::frame() {
    while (const Virtqueue::Used* const used = receive_.used()) {
        if (used->id < Virtqueue::kSize && used->size > kHead && used->size <= sizeof(Buffer))
            return {received_[used->id].data() + kHead, used->size - kHead};
        release();
    }
    return {};
}

void VirtioNet::release() {
    const std::uint32_t id = receive_.used()->id;
    receive_.take();
    if (id < Virtqueue::kSize) receive_.offer(static_cast<std::uint16_t>(id));
    offered_ = true;
}

std::span<std::uint8_t> VirtioNet::room() {
    while (const Virtqueue::Used* const used = transmit_.used()) {
        free_.push_back(static_cast<std::uint16_t>(used->id));
        transmit_.take();
    }
    if (free_.empty()) return {};
    return std::span(sent_[free_.back()]).subspan(kHead);
}

void VirtioNet::send(std::size_t size) {
    const std::uint16_t id = free_.back();
    free_.pop_back();
    transmit_.set_size(id, static_cast<std::uint32_t>(kHead + size));
    transmit_.offer(id);
    queued_ = true;
}

void VirtioNet::flush() {
    if (offered_) tell(kReceive);
    if (queued_) tell(kTransmit);
    offered_ = queued_ = false;
}

}  // namespace qduino::board::metal
