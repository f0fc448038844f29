// A virtqueue: how a driver hands buffers to a virtual device, and gets them back.
//
//   descriptors   [ buffer 0 | buffer 1 | … ]            where each buffer is, and how long
//   available     [ … 3 5 0 ] head ──► the device        "do something with these"
//   used          [ … 3 5 ]   head ◄── the device        "done, so many bytes"
//
// Both lists are rings whose heads count on for ever. Each of the driver's buffers is one
// descriptor. Virtual I/O Device (VIRTIO) 1.1, OASIS 2019, 2.6 (split virtqueues).
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace qduino::board::metal {

class Virtqueue {
  public:
    static constexpr std::uint16_t kSize = 64;

    enum class Direction : std::uint16_t { to_device = 0, from_device = 2 };

    /// What descriptor `id` stands for. Before it is offered.
    void set_buffer(std::uint16_t id, const void* at, std::uint32_t size, Direction direction) {
        descriptors_[id] = {reinterpret_cast<std::uint64_t>(at), size, static_cast<std::uint16_t>(direction),
                            0};
    }
    /// How much of it the device is to take.
    void set_size(std::uint16_t id, std::uint32_t size) { descriptors_[id].size = size; }
    /// Buffer `id` is the device's now. The device has to be told, at some time.
    void offer(std::uint16_t id) {
        available_.ring[available_.head % kSize] = id;
        head_of(available_.head)
            .store(static_cast<std::uint16_t>(available_.head + 1), std::memory_order_release);
    }

    struct Used {
        std::uint32_t id = 0;
        std::uint32_t size = 0;  ///< bytes that the device has written
    };
    /// The oldest that the device has given back and take() has not taken; null: none.
    [[nodiscard]] const Used* used() {
        if (head_of(used_.head).load(std::memory_order_acquire) == taken_) return nullptr;
        return &used_.ring[taken_ % kSize];
    }
    /// It is the driver's again.
    void take() { ++taken_; }

    /// The device need not interrupt: a hint, which it may ignore. With `wanted`, look at used()
    /// once more afterwards: what came before may not interrupt.
    void want_interrupts(bool wanted) {
        constexpr std::uint16_t kNoInterrupt = 1;
        head_of(available_.flags).store(wanted ? 0 : kNoInterrupt, std::memory_order_relaxed);
        std::atomic_thread_fence(std::memory_order_seq_cst);
    }

    // Where the device finds them.
    [[nodiscard]] std::uint64_t descriptors_at() const { return address_of(&descriptors_); }
    [[nodiscard]] std::uint64_t available_at() const { return address_of(&available_); }
    [[nodiscard]] std::uint64_t used_at() const { return address_of(&used_); }

  private:
    struct Descriptor {
        std::uint64_t at = 0;
        std::uint32_t size = 0;
        std::uint16_t flags = 0;
        std::uint16_t next = 0;
    };
    struct Available {
        std::uint16_t flags = 0;
        std::uint16_t head = 0;
        std::array<std::uint16_t, kSize> ring{};
    };
    struct UsedRing {
        std::uint16_t flags = 0;
        std::uint16_t head = 0;
        std::array<Used, kSize> ring{};
    };

    /// A word that the device reads or writes meanwhile.
    static std::atomic_ref<std::uint16_t> head_of(std::uint16_t& word) { return std::atomic_ref(word); }
    static std::uint64_t address_of(const void* part) { return reinterpret_cast<std::uint64_t>(part); }

    alignas(16) std::array<Descriptor, kSize> descriptors_{};
    alignas(2) Available available_{};
    alignas(4) UsedRing used_{};
    std::uint16_t taken_ = 0;
};

}  // namespace qduino::board::metal
