// Serial at its baud rate: on a board whose wires take time, as an AVR's.
#include <gtest/gtest.h>

#include "arduino/HardwareSerial.h"
#include "board/board.h"
#include "board/peripherals.h"
#include "board/sim/sim_board.h"
#include "runtime/runtime.h"
#include "tests/unit/arduino/memory_port.h"

namespace qduino::uart_line_test {
namespace {

/// A byte is ten bits, at 10 000 baud.
constexpr Nanoseconds kByte{1'000'000};
constexpr unsigned long kBaud = 10'000;

class Uart : public testing::Test {
  protected:
    explicit Uart(bool timed = true)
        : board_(
              [&] {
                  board::sim::SimConfig config;
                  config.serial_at_baud = timed;
                  return config;
              }(),
              wires_),
          runtime_(board_) {
        serial_.begin(kBaud, SERIAL_8N1, port_);
    }
    [[nodiscard]] Nanoseconds now() { return board_.now() - kEpoch; }
    /// What it takes the caller.
    Nanoseconds writes(std::size_t bytes) {
        const Nanoseconds before = now();
        EXPECT_EQ(serial_.write(std::string(bytes, 'x').c_str()), bytes);
        return now() - before;
    }
    void pass(Nanoseconds time) { board_.busy_until(board_.now() + time); }

    board::NoPeripherals wires_;
    board::sim::SimBoard board_;
    runtime::Runtime runtime_;
    test::MemoryPort port_;
    HardwareSerial serial_{1};
};

TEST_F(Uart, AWriterWaitsWhenTheBufferIsFull) {
    EXPECT_EQ(serial_.availableForWrite(), 63);
    EXPECT_EQ(writes(65), 0ns) << "63 in the buffer, two in the hardware";
    EXPECT_EQ(serial_.availableForWrite(), 0);
    EXPECT_EQ(writes(1), kByte);
    EXPECT_EQ(writes(100), 100 * kByte);
    EXPECT_EQ(port_.output.size(), 166U) << "nothing is lost";
    pass(10 * kByte);
    EXPECT_EQ(serial_.availableForWrite(), 10);
    EXPECT_EQ(writes(10), 0ns);
}

TEST_F(Uart, FlushWaitsUntilTheLastByteHasLeft) {
    static_cast<void>(writes(20));
    const Nanoseconds before = now();
    serial_.flush();
    EXPECT_EQ(now() - before, 20 * kByte);
    EXPECT_EQ(serial_.availableForWrite(), 63);
    serial_.flush();
    EXPECT_EQ(now() - before, 20 * kByte) << "none is under way";
}

TEST_F(Uart, AFrameHasTheBitsOfItsConfiguration) {
    serial_.begin(kBaud, SERIAL_7E2, port_);  // start, seven, parity, two stops: eleven
    static_cast<void>(writes(2));
    const Nanoseconds before = now();
    serial_.flush();
    EXPECT_EQ(now() - before, 2 * kByte * 11 / 10);
}

TEST_F(Uart, BytesComeInOneAfterTheOther) {
    port_.input = "abc";
    EXPECT_EQ(serial_.available(), 1);
    EXPECT_EQ(serial_.read(), 'a');
    EXPECT_EQ(serial_.read(), -1) << "the next is on its way";
    EXPECT_EQ(serial_.peek(), -1);
    pass(kByte);
    EXPECT_EQ(serial_.available(), 1);
    pass(5 * kByte);
    EXPECT_EQ(serial_.available(), 2);
    EXPECT_EQ(serial_.peek(), 'b');
    EXPECT_EQ(serial_.read(), 'b');
    EXPECT_EQ(serial_.read(), 'c');
    EXPECT_EQ(serial_.available(), 0);
    port_.input = "d";
    EXPECT_EQ(serial_.read(), 'd') << "a line that was quiet is quick";
}

TEST_F(Uart, AFullBufferMakesTheOtherSideWaitAndLosesNothing) {
    port_.input = std::string(200, 'x');
    EXPECT_EQ(serial_.available(), 1);
    pass(500 * kByte);
    EXPECT_EQ(serial_.available(), 63);
    for (int i = 0; i < 63; ++i) EXPECT_EQ(serial_.read(), 'x');
    EXPECT_LE(serial_.available(), 1);
    int all = 63;
    for (int i = 0; i < 300; ++i) {
        pass(kByte);
        while (serial_.read() >= 0) ++all;
    }
    EXPECT_EQ(all, 200);
}

TEST_F(Uart, WaitsAreDescribed) {
    std::string notes;
    serial_.describe_waits(notes);
    EXPECT_EQ(notes, "");
    static_cast<void>(writes(165));
    serial_.describe_waits(notes);
    EXPECT_EQ(notes.substr(0, notes.find('\n')),
              "Serial1 at 10000 baud had no room for 0.100 s: setup() waited 100.0 ms at once.");
}

class QuickUart : public Uart {
  protected:
    QuickUart() : Uart(false) {}
};

TEST_F(QuickUart, WhereWiresTakeNoTimeNobodyWaits) {
    EXPECT_EQ(writes(10'000), 0ns);
    EXPECT_EQ(serial_.availableForWrite(), 64) << "the port's own";
    port_.input = "abc";
    EXPECT_EQ(serial_.available(), 3);
    serial_.flush();
    EXPECT_EQ(now(), 0ns);
}

}  // namespace
}  // namespace qduino::uart_line_test
