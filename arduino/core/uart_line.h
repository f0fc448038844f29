// How long a serial port's bytes take, on a board whose wires take time: the simulator.
//
// A sketch that prints without a pause is slow on an AVR, for a byte at 9600 baud takes 1 ms. It
// would write hundreds of megabytes where a byte takes none. So the port is an AVR's
// (HardwareSerial.cpp of ArduinoCore-avr): 63 bytes wait in its buffer, two are in the hardware,
// and a writer who finds no room waits on his own CPU time:
//
//   write ──► buffer (63) ──► data register ──► shift register ──► wire, a frame after the other
//   read  ◄── buffer (63) ◄────────────────────────────────────── wire
//
// What comes in takes its time as well. Nothing of it is lost: where the buffer is full, the other
// side waits.
//
// It is arithmetic on instants; the bytes themselves are the port's. Calls come from one loop at a
// time (HardwareSerial holds its lock).
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/time.h"
#include "board/types.h"

namespace qduino::arduino {

class UartLine {
  public:
    /// Bytes that wait in front of the hardware, or behind it.
    static constexpr std::size_t kBuffer = 63;
    static constexpr std::size_t kInHardware = 2;

    /// What writers waited that found no room.
    struct Waits {
        Nanoseconds all{};
        Nanoseconds longest{};
        board::VcpuId whose = board::kNoVcpu;  ///< the longest one's; kNoVcpu: setup()'s
    };

    /// As Serial.begin(). Bytes take no time where the board's wires take none, and at 0 baud.
    void open(unsigned long baud, std::uint16_t config);
    [[nodiscard]] bool takes_time() const { return frame_ > Nanoseconds{0}; }
    [[nodiscard]] unsigned long baud() const { return baud_; }

    /// The calling VCPU writes so many bytes: returns when the last one is in the buffer.
    void send(std::size_t bytes);
    /// Bytes that send() would take without a wait. Contract: takes_time().
    [[nodiscard]] std::size_t room() const;
    /// Waits until the last byte has left.
    void drain() const;

    /// So many of the `offered` bytes that the port holds have come in. Contract: takes_time().
    [[nodiscard]] std::size_t arrived(std::size_t offered);
    /// One of those was read.
    void took() { --unread_; }

    [[nodiscard]] const Waits& waits() const { return waits_; }

  private:
    unsigned long baud_ = 0;
    Nanoseconds frame_{};  // one byte's on the wire; 0: it takes no time
    Instant sent_{};       // the last byte has left
    Instant next_in_{};    // no byte comes in before
    bool idle_ = true;     // the other side had nothing more at the last look
    std::size_t unread_ = 0;
    Waits waits_;
};

}  // namespace qduino::arduino
