// A network card as the stack above it sees it: frames in, frames out, and an interrupt when some
// came.
//
//   card ─► frame() … release() ─► stack ─► room() … send() ─► card        flush() tells the card
//
// All but interrupt(): from the bottom half of the card.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "board/metal/core/device_interrupts.h"

namespace qduino::board::metal {

class NetworkCard {
  public:
    using Address = std::array<std::uint8_t, 6>;

    /// Finds the card and starts it, with its interrupt off. False: there is none.
    [[nodiscard]] virtual bool open() = 0;
    [[nodiscard]] virtual const Address& address() const = 0;
    /// Its interrupts are `device`'s from now on. Once.
    virtual void add_to(DeviceInterrupts& interrupts, Device& device) = 0;
    /// Whether it interrupts when frames come. From its top half, too.
    virtual void interrupt(bool on) = 0;

    /// The oldest frame that came; empty: none. It stays until release().
    [[nodiscard]] virtual std::span<const std::uint8_t> frame() = 0;
    virtual void release() = 0;
    /// Room for the next frame to send; empty: all is under way.
    [[nodiscard]] virtual std::span<std::uint8_t> room() = 0;
    /// Sends the first `size` bytes of room(), at the latest with flush().
    virtual void send(std::size_t size) = 0;
    virtual void flush() = 0;

  protected:
    ~NetworkCard() = default;
};

}  // namespace qduino::board::metal
