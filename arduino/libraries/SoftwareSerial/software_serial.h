// SoftwareSerial: a serial port on any two pins, made by software. (API of Arduino's library.)
//
//   line  ▔▔▔▔▁▁▁▁▔▔▔▔▁▁▁▁▁▁▁▁▔▔▔▔…▔▔▔▔   start bit (low), 8 data bits, the lowest first, stop bit
//   looks ↑↑↑↑    ↑   ↑   ↑   ↑          after the start bit's edge once in the middle of each bit
//
// A loop serves all ports, and owns a core for it (SoftwareSerial.h): it looks at the receiving
// line sixteen times in a bit, and puts each sent bit out at its instant. So it sends and receives
// at once, where the AVR's library can do one of the two. In setup(), when no loop runs yet, a call
// that reads, writes or waits serves the ports itself.
//
// As in Arduino's library one port listens at a time: what arrives at another is lost.
#pragma once

#include <atomic>
#include <cstdint>

#include "arduino/Stream.h"
#include "base/time.h"
#include "channel/ring_buffer.h"

#define _SS_MAX_RX_BUFF 64

class SoftwareSerial : public Stream {
  public:
    /// `inverse`: idle is low.
    SoftwareSerial(int receive_pin, int transmit_pin, bool inverse = false)
        : receive_pin_(receive_pin), transmit_pin_(transmit_pin), inverse_(inverse) {}
    ~SoftwareSerial() override { end(); }
    SoftwareSerial(const SoftwareSerial&) = delete;
    SoftwareSerial& operator=(const SoftwareSerial&) = delete;

    /// Setup-time. 300 to 115200 baud; the port then listens.
    void begin(long baud);
    /// From now on this port receives, and no other; what it held is dropped. False: it did
    /// already.
    bool listen();
    [[nodiscard]] bool isListening() const;
    bool stopListening();
    void end();
    /// True once after bytes were lost because nobody read them.
    bool overflow() { return overflowed_.exchange(false, std::memory_order_relaxed); }

    int available() override;
    int read() override;
    int peek() override;
    /// Waits for room for one byte; the loop sends it.
    std::size_t write(std::uint8_t value) override;
    using Print::write;
    int availableForWrite() override { return static_cast<int>(out_.kCapacity - out_.size()); }
    /// Waits until everything written has left.
    void flush() override;
    explicit operator bool() const { return true; }

    /// Looks at all ports once, and spins until the next look is due: the body of their loop.
    static void serve();

  private:
    /// A frame on the line: the bits that are left, and when the next is due.
    struct Frame {
        unsigned bits = 0;
        int left = 0;
        qduino::Instant due{};
    };
    void send_at(qduino::Instant now);
    void receive_at(qduino::Instant now);
    void take_bit(bool high);
    [[nodiscard]] bool line_is_high() const;

    int receive_pin_, transmit_pin_;
    bool inverse_;
    qduino::Nanoseconds bit_{};  // zero: not begun
    Frame sent_, received_;      // the serving loop's
    bool idle_seen_ = false;
    std::atomic<bool> sending_{false}, overflowed_{false};
    qduino::channel::RingBuffer<std::uint8_t, 64> out_, in_;
};

namespace qduino::arduino {
/// The body of the ports' loop.
void serve_software_serial();
}  // namespace qduino::arduino
