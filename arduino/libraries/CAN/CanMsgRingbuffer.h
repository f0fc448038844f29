// CanMsgRingbuffer: frames in the order in which they came, 32 at most. (As in ArduinoCore-API.)
// For one loop.
#pragma once

#include <array>
#include <cstddef>

#include "arduino/libraries/CAN/CanMsg.h"

class CanMsgRingbuffer {
  public:
    static constexpr std::size_t RING_BUFFER_SIZE = 32;

    [[nodiscard]] bool isFull() const { return count_ == RING_BUFFER_SIZE; }
    [[nodiscard]] bool isEmpty() const { return count_ == 0; }
    [[nodiscard]] std::size_t available() const { return count_; }
    /// Nothing happens when it is full.
    void enqueue(const CanMsg& msg) {
        if (!isFull()) frames_[(first_ + count_++) % RING_BUFFER_SIZE] = msg;
    }
    /// The oldest, taken out; an empty frame when none is there.
    CanMsg dequeue() {
        if (isEmpty()) return {};
        const CanMsg& oldest = frames_[first_];
        first_ = (first_ + 1) % RING_BUFFER_SIZE;
        --count_;
        return oldest;
    }

  private:
    std::array<CanMsg, RING_BUFFER_SIZE> frames_{};
    std::size_t first_ = 0, count_ = 0;
};

namespace arduino {
using ::CanMsgRingbuffer;
}  // namespace arduino
