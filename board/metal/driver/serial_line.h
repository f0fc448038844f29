// A serial line: a UART, whose bytes go through two rings.
//
//   write() ─► ring ─► serve(): a FIFO at a time ───► UART ─► wire
//   read()  ◄─ ring ◄─ serve() ◄──────────────────── UART ◄─ wire
//                        ▲ when the UART interrupts: bytes came, or its transmitter is empty
//
// The UART is a 16550 or a PL011 (driver/uart_16550.h, driver/pl011.h). Any number of writers, one
// reader at a time; serve() on its I/O VCPU, or in the top half where it has none.
#pragma once

#include <cstdint>
#include <span>

#include "board/metal/computer/spin_lock.h"
#include "board/metal/computer/uart.h"
#include "board/metal/core/device_interrupts.h"
#include "board/window/beside_layout.h"
#include "channel/ring_buffer.h"

namespace qduino::board::metal {

class SerialLine : public Device {
  public:
    constexpr explicit SerialLine(Uart uart) : uart_(uart) {}

    /// 115,200 baud, 8N1, FIFOs on, no interrupts. Once. False: there is no UART.
    bool open() { return uart_.open(); }
    /// It has no UART: the bytes go through Linux's rings. What does not fit is dropped while Linux
    /// takes nothing. In the place of open() and listen().
    void lead_to(BesideLine& line);
    /// From now on it interrupts when bytes come.
    void listen();

    /// Takes as many as there is room for, and returns how many.
    std::size_t write(std::span<const std::uint8_t> bytes);
    [[nodiscard]] std::size_t room() const { return out_->free(); }
    /// Or nobody takes the rest.
    [[nodiscard]] bool all_sent() const;
    [[nodiscard]] std::size_t available() const { return in_->size(); }
    [[nodiscard]] bool read(std::uint8_t& byte) { return in_->try_pop(byte); }
    [[nodiscard]] bool peek(std::uint8_t& byte);

    /// Sends what is in the ring, and then `text`, without interrupts: where none are served. It
    /// takes no lock, for a panic.
    void send_now(std::span<const char> text);

    void quiet() override;

  protected:
    /// A byte came. The line keeps it for read(); a derived one does what it likes with it.
    virtual void received(std::uint8_t byte) { static_cast<void>(in_->try_push(byte)); }
    ~SerialLine() = default;

  private:
    void serve() override;
    void let_interrupt();

    Uart uart_;
    bool listens_ = false;
    bool quiet_ = false;  // quieted, and not served yet; under lock_
    SpinLock lock_;
    SpinLock writers_lock_;  // between Serial and the C library's standard output
    decltype(BesideLine::out) own_out_;
    decltype(BesideLine::in) own_in_;
    decltype(BesideLine::out)* out_ = &own_out_;  // or Linux's
    decltype(BesideLine::in)* in_ = &own_in_;
};

/// The line of Serial.
class ConsoleLine final : public SerialLine {
  public:
    constexpr ConsoleLine() : SerialLine(Uart::first()) {}
};
extern ConsoleLine console_line;

}  // namespace qduino::board::metal
