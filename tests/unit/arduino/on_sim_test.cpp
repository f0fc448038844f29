// The Arduino face on the simulator: two loops on one core share a bus, a port and a ring, and
// nobody hangs or mixes.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

#include "arduino/HardwareSerial.h"
#include "board/board.h"
#include "board/peripherals.h"
#include "board/sim/sim_board.h"
#include "runtime/runtime.h"
#include "tests/unit/arduino/on_sim_sketch.h"

namespace {

using namespace qduino;

class SlowPort final : public qduino::arduino::SerialPort {
  public:
    Result<void> open(unsigned long, std::uint16_t) override { return {}; }
    void close() override {}
    std::size_t available() override { return 0; }
    int read() override { return -1; }
    int peek() override { return -1; }
    std::size_t write(std::span<const std::uint8_t> bytes) override {
        for (const std::uint8_t byte : bytes) {
            board::current().busy_until(board::current().now() + 50us);
            text += static_cast<char>(byte);
        }
        return bytes.size();
    }
    std::size_t room() override { return 1; }
    void flush() override {}
    std::string text;
};

SlowPort only_port;

/// Listens to the tone's pin and to the bus: which chip was selected when a byte came.
class Wires final : public board::Peripherals {
  public:
    void pin_written(Instant now, board::PinId pin, board::Level level) override {
        const bool high = level == board::Level::high;
        if (pin.number == 20 && lamp.empty()) lamp = high ? "high" : "low";
        if (pin.number == 8) tone_edges.push_back(now);
        for (std::size_t i = 0; i < 2; ++i) {
            if (pin.number == chip_selects[i]) selected[i] = !high;
        }
    }
    void pwm_written(Instant, board::PinId, double) override {}
    /// The wheel's sensor changes each 100 ms.
    board::Level pin_level(Instant now, board::PinId pin) override {
        const bool high = pin.number == 21 && (now - kEpoch) / 100ms % 2 == 1;
        return high ? board::Level::high : board::Level::low;
    }
    double analog_level(Instant, board::PinId) override { return 0; }
    Result<void> i2c_transfer(Instant, board::I2cBus, board::I2cAddress, std::span<const std::uint8_t>,
                              std::span<std::uint8_t>) override {
        return {};
    }
    Result<void> spi_transfer(Instant, board::SpiBus, board::SpiSettings,
                              std::span<std::uint8_t> data) override {
        ++transfers;
        const std::size_t who = data[0];
        if (!selected[who] || selected[1 - who]) ++wrong_transfers;
        return {};
    }

    std::vector<Instant> tone_edges;
    std::string lamp;  // its first level
    bool selected[2] = {false, false};
    int transfers = 0;
    int wrong_transfers = 0;
};

class ArduinoOnSim : public testing::Test {
  protected:
    /// A sketch is one program: it runs once, and the tests look at what it did.
    static void SetUpTestSuite() {
        board::sim::SimConfig config;
        config.cores = 2;
        board::sim::SimBoard board(config, wires);
        runtime::Runtime runtime(board);
        const Result<void> begun = runtime.begin(runtime::sketch_table());
        ASSERT_TRUE(begun.ok()) << begun.error().message.view();
        runtime.run(kEpoch + 2s);
        board.request_stop();
        runtime.run(board.now() + 1s);
        EXPECT_TRUE(board.stopped()) << "no loop hangs in a wait";
    }
    static inline Wires wires;
};

}  // namespace

qduino::arduino::SerialPort& slow_port() { return only_port; }

TEST_F(ArduinoOnSim, ABusTransactionIsNotInterruptedByTheOtherLoops) {
    EXPECT_GT(wires.transfers, 400);
    EXPECT_EQ(wires.wrong_transfers, 0);
}

TEST_F(ArduinoOnSim, AStaticObjectsPinsAndInterruptHoldFromSetupOn) {
    EXPECT_EQ(level_of_wheel_before_setup, HIGH) << "of a pin with a pull-up";
    EXPECT_EQ(wires.lamp, "high");
    EXPECT_EQ(looks_before_setup, 1) << "beside the interrupt that waits for setup()";
    EXPECT_GE(wheel_edges, 18);
    EXPECT_LE(wheel_edges, 20);
}

TEST_F(ArduinoOnSim, LinesArriveWhole) {
    std::multiset<std::string> lines;
    std::string line;
    for (const char c : only_port.text) {
        line += c;
        if (c != '\n') continue;
        lines.insert(line);
        line.clear();
    }
    const auto first = lines.count("the first loop was here\r\n");
    const auto second = lines.count("the second loop was here\r\n");
    EXPECT_GT(first, 30U);
    EXPECT_GT(second, 150U);
    EXPECT_EQ(first + second, lines.size());
}

TEST_F(ArduinoOnSim, TheRingLosesNothing) {
    ASSERT_EQ(received.size(), 20U);
    for (int i = 0; i < 20; ++i) EXPECT_EQ(received[static_cast<std::size_t>(i)], i);
}

TEST_F(ArduinoOnSim, TheToneBeginsInSetupAndEndsOnItsLoop) {
    ASSERT_GE(wires.tone_edges.size(), 38U);
    EXPECT_LE(wires.tone_edges.size(), 42U);
    // The first is the pin becoming an output.
    for (std::size_t i = 2; i < wires.tone_edges.size(); ++i) {
        EXPECT_GE(wires.tone_edges[i] - wires.tone_edges[i - 1], 499us);
    }
    EXPECT_LE(wires.tone_edges.back(), kEpoch + 21ms);
}
