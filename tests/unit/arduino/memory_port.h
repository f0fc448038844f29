// A serial port of memory: what a sketch wrote, and what it is to read.
#pragma once

#include <span>
#include <string>

#include "arduino/core/serial_port.h"

namespace qduino::test {

class MemoryPort : public arduino::SerialPort {
  public:
    Result<void> open(unsigned long baud, std::uint16_t config) override {
        opened_with = baud;
        opened_config = config;
        if (refuse) return make_error(ErrorCode::not_found, "no such port");
        return {};
    }
    void close() override { closed = true; }
    std::size_t available() override { return input.size(); }
    int peek() override { return input.empty() ? -1 : static_cast<unsigned char>(input[0]); }
    int read() override {
        const int value = peek();
        if (value >= 0) input.erase(0, 1);
        return value;
    }
    std::size_t write(std::span<const std::uint8_t> bytes) override {
        output.append(bytes.begin(), bytes.end());
        return bytes.size();
    }
    std::size_t room() override { return 64; }
    void flush() override { ++flushes; }

    std::string input;
    std::string output;
    unsigned long opened_with = 0;
    std::uint16_t opened_config = 0;
    bool refuse = false;
    bool closed = false;
    int flushes = 0;
};

}  // namespace qduino::test
