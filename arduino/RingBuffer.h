// RingBufferN<N>: bytes in the order in which they came, N at most: the buffer behind a serial
// port, as ArduinoCore-API has it and libraries use it. One loop stores, one loop reads.
//
// A sketch's own RingBuffer<T, N> (core/channels.h) is another class. So the API's name for a
// buffer of 64 stands in its namespace alone: arduino::RingBuffer.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "channel/ring_buffer.h"

#define SERIAL_BUFFER_SIZE 64

namespace arduino {

template <int N>
class RingBufferN {
    static_assert(N >= 1);

  public:
    /// Nothing happens when it is full.
    void store_char(std::uint8_t value) {
        if (!isFull()) static_cast<void>(ring_.try_push(value));
    }
    /// The reader alone may call it.
    void clear() {
        while (read_char() >= 0) {
        }
    }
    /// The oldest byte, taken out; −1: none is there.
    int read_char() {
        std::uint8_t value = 0;
        return ring_.try_pop(value) ? value : -1;
    }
    /// The oldest byte, left in; −1: none is there.
    int peek() {
        const std::uint8_t* const next = ring_.front();
        return next ? *next : -1;
    }
    int available() { return static_cast<int>(ring_.size()); }
    int availableForStore() { return N - available(); }
    bool isFull() { return available() >= N; }

  private:
    qduino::channel::RingBuffer<std::uint8_t, std::bit_ceil(static_cast<std::size_t>(N))> ring_;
};

using RingBuffer = RingBufferN<SERIAL_BUFFER_SIZE>;

}  // namespace arduino

using arduino::RingBufferN;
