// Serial on a machine without an operating system: the first serial line (board/metal).
#include "board/metal/driver/serial_line.h"

#include "arduino/core/serial_port.h"
#include "board/board.h"

namespace qduino::arduino::metal {
namespace {

using board::metal::console_line;

class LinePort final : public arduino::SerialPort {
  public:
    explicit LinePort(int number) : number_(number) {}

    /// The line has its 115,200 baud, whatever is asked for. Error: only the first is there.
    Result<void> open(unsigned long, std::uint16_t) override {
        if (number_ == 0) return {};
        return make_error(ErrorCode::unsupported, "this board has one serial port: Serial");
    }
    void close() override {}
    std::size_t available() override { return console_line.available(); }
    int read() override {
        std::uint8_t byte = 0;
        return console_line.read(byte) ? byte : -1;
    }
    int peek() override {
        std::uint8_t byte = 0;
        return console_line.peek(byte) ? byte : -1;
    }
    std::size_t write(std::span<const std::uint8_t> bytes) override {
        for (std::span left = bytes;;) {
            left = left.subspan(console_line.write(left));
            if (left.empty()) return bytes.size();
            pause();
        }
    }
    std::size_t room() override { return console_line.room(); }
    void flush() override {
        while (!console_line.all_sent()) pause();
    }

  private:
    static void pause() { board::current().sleep_until(board::current().now() + 100us); }

    int number_;
};

}  // namespace
}  // namespace qduino::arduino::metal

std::unique_ptr<qduino::arduino::SerialPort> qduino::arduino::default_serial_port(int number) {
    return std::make_unique<metal::LinePort>(number);
}
