// Serial: a Stream over a port of bytes. Safe from every loop: each call reaches the port whole.
//
//   Serial           standard input and output of the program
//   Serial1 … 3      from the environment: QDUINO_SERIAL1=/dev/ttyUSB0, or pty, or pty:/tmp/link
//                    (default: pty); begin() prints the pseudo-terminal's name on stderr
//   Serial.begin(baud, config, port)   any SerialPort of your own
//
// A slow terminal must not stop a loop with a deadline. So writing puts bytes into a ring, and a
// thread of the system's ordinary class carries them out. Only a full ring (64 KB) makes a writer
// wait. In the simulator a byte takes its time at the baud rate (core/uart_line.h).
#pragma once

#include <memory>
#include <string>

#include "arduino/Stream.h"
#include "arduino/core/lock.h"
#include "arduino/core/serial_port.h"
#include "arduino/core/uart_line.h"

// data bits, parity, stop bits: bits 0–1 = stop bits, 4–5 = parity (0 none, 1 even, 2 odd), 8–11 =
// data bits
inline constexpr std::uint16_t SERIAL_5N1 = 0x501, SERIAL_6N1 = 0x601, SERIAL_7N1 = 0x701, SERIAL_8N1 = 0x801;
inline constexpr std::uint16_t SERIAL_5N2 = 0x502, SERIAL_6N2 = 0x602, SERIAL_7N2 = 0x702, SERIAL_8N2 = 0x802;
inline constexpr std::uint16_t SERIAL_5E1 = 0x511, SERIAL_6E1 = 0x611, SERIAL_7E1 = 0x711, SERIAL_8E1 = 0x811;
inline constexpr std::uint16_t SERIAL_5E2 = 0x512, SERIAL_6E2 = 0x612, SERIAL_7E2 = 0x712, SERIAL_8E2 = 0x812;
inline constexpr std::uint16_t SERIAL_5O1 = 0x521, SERIAL_6O1 = 0x621, SERIAL_7O1 = 0x721, SERIAL_8O1 = 0x821;
inline constexpr std::uint16_t SERIAL_5O2 = 0x522, SERIAL_6O2 = 0x622, SERIAL_7O2 = 0x722, SERIAL_8O2 = 0x822;

// Which ports there are, for libraries that ask (the Mega's answers).
#define HAVE_HWSERIAL0
#define HAVE_HWSERIAL1
#define HAVE_HWSERIAL2
#define HAVE_HWSERIAL3
#define SERIAL_PORT_MONITOR Serial
#define SERIAL_PORT_HARDWARE Serial
#define SERIAL_PORT_HARDWARE1 Serial1
#define SERIAL_PORT_HARDWARE2 Serial2
#define SERIAL_PORT_HARDWARE3 Serial3
#define SERIAL_PORT_HARDWARE_OPEN Serial1
#define SERIAL_PORT_HARDWARE_OPEN1 Serial2
#define SERIAL_PORT_HARDWARE_OPEN2 Serial3

/// Where bytes take time (a board file's uart_per_byte), say in setup() which loops write, and how
/// long: Serial.heldBy(1, 2ms). Else admission assumes that every loop of a core writes kUsualBytes
/// at a time.
class HardwareSerial : public Stream, public qduino::arduino::SaysWhoHolds<HardwareSerial> {
  public:
    /// A long line.
    static constexpr std::size_t kUsualBytes = 128;

    /// Serial `number`; 0 is the console.
    explicit HardwareSerial(int number)
        : number_(number), lock_(name_of(number), qduino::board::DeviceClass::uart, kUsualBytes) {}
    /// A port that was handed in may be gone already: it is its owner's to close.
    ~HardwareSerial() override {
        if (owned_) end();
    }
    HardwareSerial(const HardwareSerial&) = delete;
    HardwareSerial& operator=(const HardwareSerial&) = delete;

    /// Setup-time. Opens the default port, or `port`, which must outlive this object or end().
    void begin(unsigned long baud, std::uint16_t config = SERIAL_8N1);
    void begin(unsigned long baud, std::uint16_t config, qduino::arduino::SerialPort& port);
    void end();
    /// True from the start for the console, for another port once it is open: a sketch's
    /// `while (!Serial)` ends at once, also in front of begin().
    explicit operator bool() const { return number_ == 0 || port_ != nullptr; }

    int available() override;
    int read() override;
    int peek() override;
    int availableForWrite() override;
    void flush() override;
    std::size_t write(std::uint8_t value) override { return write(&value, 1); }
    std::size_t write(const std::uint8_t* buffer, std::size_t size) override;
    template <typename T>
    requires std::is_integral_v<T> std::size_t write(T value) {
        return write(static_cast<std::uint8_t>(value));
    }
    using Print::write;
    /// For the program around the sketch, when no loop runs: waits up to `ms` until everything has
    /// left. Takes no lock.
    void settle(int ms);
    /// For the program around the sketch: true holds back what is written, false lets it go.
    void hold_output(bool held);
    /// For the program around the sketch, when no loop runs: why bytes were lost that were written;
    /// null: none was.
    [[nodiscard]] const char* lost() const { return port_ ? port_->lost() : nullptr; }
    /// Appends a line to `notes` when writers waited for room in the buffer.
    void describe_waits(std::string& notes) const;

  protected:
    void hold() override { lock_.lock(); }
    void release() override { lock_.unlock(); }

  private:
    /// What the port answers under the lock; `otherwise` when there is none.
    template <typename Answer>
    int ask(Answer answer, int otherwise);
    /// Bytes that have come in.
    [[nodiscard]] std::size_t arrived();
    void open(unsigned long baud, std::uint16_t config, qduino::arduino::SerialPort* port);

    friend class qduino::arduino::SaysWhoHolds<HardwareSerial>;
    static constexpr const char* name_of(int number) {
        return number == 0 ? "Serial" : number == 1 ? "Serial1" : number == 2 ? "Serial2" : "Serial3";
    }

    int number_;
    qduino::arduino::Lock lock_;
    qduino::arduino::SerialPort* port_ = nullptr;  // null: not begun, what is written is dropped
    std::unique_ptr<qduino::arduino::SerialPort> owned_;
    qduino::arduino::UartLine line_;
};

extern HardwareSerial Serial;
extern HardwareSerial Serial1;
extern HardwareSerial Serial2;
extern HardwareSerial Serial3;

namespace qduino::arduino {
/// The same of Serial, for a program that must not link it by itself (apps/sketch/sketch_main.cpp).
void settle_console(int ms);
void hold_console(bool held);
[[nodiscard]] const char* console_lost();
/// Lines about the waits of all ports, or nothing.
[[nodiscard]] std::string serial_waits();
}  // namespace qduino::arduino

namespace arduino {
using ::HardwareSerial;
}  // namespace arduino
