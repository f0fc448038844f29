// The wire behind a HardwareSerial: standard input and output, a pseudo-terminal, a real port, or a
// test's memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "base/result.h"

namespace qduino::arduino {

/// One side of a serial line. Calls come from one loop at a time (HardwareSerial holds its lock).
class SerialPort {
  public:
    virtual ~SerialPort() = default;

    /// Setup-time. `config` is one of the SERIAL_… words.
    virtual Result<void> open(unsigned long baud, std::uint16_t config) = 0;
    virtual void close() = 0;

    /// Bytes that read() would give now, without waiting.
    [[nodiscard]] virtual std::size_t available() = 0;
    /// The oldest byte, or -1.
    virtual int read() = 0;
    virtual int peek() = 0;

    /// Takes all of `bytes`. Waits for room if there is none, or drops them where nobody may be
    /// listening. Returns how many were taken.
    virtual std::size_t write(std::span<const std::uint8_t> bytes) = 0;
    /// Bytes that write() would take without waiting.
    [[nodiscard]] virtual std::size_t room() = 0;
    /// Waits until everything written has left.
    virtual void flush() = 0;
    /// The same, but no longer than about `ms`: the other side may not be reading.
    virtual void flush_for(int ms) {
        static_cast<void>(ms);
        flush();
    }
    /// True: holds back what is written; false: lets it leave again. Does nothing where that makes
    /// no sense.
    virtual void hold_output(bool held) { static_cast<void>(held); }
    /// Why bytes that were written did not leave, and never will; null: none was lost. A reader
    /// that has gone is no loss. When no loop runs.
    [[nodiscard]] virtual const char* lost() const { return nullptr; }
};

/// The port of Serial `number`: 0 is the console. A program is linked with the one of its system:
/// host/serial_ports.cpp on Linux and in the simulator, arduino/metal/line_port.cpp without one.
std::unique_ptr<SerialPort> default_serial_port(int number);

}  // namespace qduino::arduino
