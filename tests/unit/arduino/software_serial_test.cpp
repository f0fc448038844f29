// SoftwareSerial on the simulator: what is sent on one pin comes back on the other, at every speed;
// and frames that are none.
#include "arduino/libraries/SoftwareSerial/SoftwareSerial.h"

#include <gtest/gtest.h>

#include <functional>
#include <utility>
#include <vector>

#include "arduino/Arduino.h"
#include "board/board.h"
#include "board/peripherals.h"
#include "board/sim/sim_board.h"
#include "runtime/runtime.h"

namespace software_serial_test {
namespace {

using namespace qduino;

constexpr int kReceive = 10, kTransmit = 11, kWitness = 12;

/// A wire from kTransmit to kReceive, unless a test plays the line itself.
class Wire final : public board::NoPeripherals {
  public:
    void pin_written(Instant now, board::PinId pin, board::Level level) override {
        if (pin.number != kTransmit) return;
        high_ = level == board::Level::high;
        edges.push_back(now);
    }
    board::Level pin_level(Instant now, board::PinId pin) override {
        if (pin.number != kReceive) return board::Level::low;
        return (played ? played(now) : high_) ? board::Level::high : board::Level::low;
    }

    std::vector<Instant> edges;
    std::function<bool(Instant)> played;

  private:
    bool high_ = true;
};

/// Runs a sketch with this classic loop for `length`, and the port's own loop beside it.
void run(Wire& wire, void (*setup)(), void (*loop)(), Nanoseconds length) {
    board::sim::SimConfig config;
    config.cores = 2;
    board::sim::SimBoard board(config, wire);
    runtime::Runtime runtime(board);
    runtime::SketchTable table = runtime::sketch_table();
    table.setup = setup;
    ASSERT_TRUE(table.loops.try_push_back(
        {{.id = 1, .budget = 80ms, .period = 100ms, .core = 0}, loop, "test", 1, true}));
    const Result<void> begun = runtime.begin(table);
    ASSERT_TRUE(begun.ok()) << begun.error().message.view();
    runtime.run(kEpoch + length);
    board.request_stop();
    runtime.run(board.now() + 1s);
}

SoftwareSerial* port = nullptr;
long speed = 0;
std::vector<int> received;
bool sent = false;

void begin_port() { port->begin(speed); }

void take_all() {
    while (port->available() > 0) received.push_back(port->read());
}

void echo_256() {
    take_all();
    if (std::exchange(sent, true)) return delay(1);
    for (int i = 0; i < 256; ++i) {
        port->write(static_cast<std::uint8_t>(i));
        take_all();
    }
    // As many as wait to be sent, and one on the line, are more than the port holds for a reader.
    while (port->availableForWrite() < 64) {
        take_all();
        delay(1);
    }
    port->flush();
    take_all();
}

class SoftwareSerialTest : public testing::TestWithParam<long> {
  protected:
    void SetUp() override {
        received.clear();
        sent = false;
    }
};

TEST_P(SoftwareSerialTest, EveryByteComesBack) {
    SoftwareSerial made(kReceive, kTransmit);
    port = &made;
    speed = GetParam();
    Wire wire;
    run(wire, begin_port, echo_256, Nanoseconds{3'000'000'000'000 / speed} + 100ms);
    ASSERT_EQ(received.size(), 256u);
    for (int i = 0; i < 256; ++i) EXPECT_EQ(received[static_cast<std::size_t>(i)], i);
    EXPECT_FALSE(made.overflow());
}
INSTANTIATE_TEST_SUITE_P(Speeds, SoftwareSerialTest, testing::Values(1200L, 9600L, 38400L, 115200L));

TEST(SoftwareSerialLine, BitsLastAsLongAsTheyShould) {
    SoftwareSerial made(kReceive, kTransmit);
    port = &made;
    speed = 9600;
    Wire wire;
    run(
        wire, begin_port,
        [] {
            static bool written = false;
            if (!written) port->write('U');  // 0x55: an edge at every bit
            written = true;
            delay(1);
        },
        50ms);
    // The pin becomes an output, idles, and then has ten edges: start, eight data bits, stop.
    ASSERT_GE(wire.edges.size(), 10u);
    const std::vector<Instant> frame(wire.edges.end() - 10, wire.edges.end());
    for (std::size_t i = 1; i < frame.size(); ++i)
        EXPECT_NEAR(static_cast<double>((frame[i] - frame[i - 1]).count()), 1e9 / 9600, 1000) << i;
}

TEST(SoftwareSerialLine, WorksInSetup) {
    SoftwareSerial made(kReceive, kTransmit);
    port = &made;
    speed = 9600;
    received.clear();
    Wire wire;
    run(
        wire,
        [] {
            begin_port();
            port->print("ok");
            delay(3);
            take_all();
        },
        [] { delay(1); }, 20ms);
    EXPECT_EQ(received, (std::vector<int>{'o', 'k'}));
}

TEST(SoftwareSerialLine, ALineWithoutAStopBitGivesNoByte) {
    SoftwareSerial made(kReceive, kTransmit);
    port = &made;
    speed = 9600;
    received.clear();
    Wire wire;
    // High, then low for ever: a broken wire.
    wire.played = [](Instant now) { return now < kEpoch + 5ms; };
    run(
        wire, begin_port,
        [] {
            take_all();
            delay(1);
        },
        50ms);
    EXPECT_TRUE(received.empty());
}

TEST(SoftwareSerialLine, WhatNobodyReadsIsLostAndSaidOnce) {
    SoftwareSerial made(kReceive, kTransmit);
    port = &made;
    speed = 115200;
    Wire wire;
    run(
        wire, begin_port,
        [] {
            for (int i = 0; i < 100; ++i) port->write('x');
            port->flush();
            delay(1000);
        },
        200ms);
    EXPECT_TRUE(made.overflow());
    EXPECT_FALSE(made.overflow());
    EXPECT_EQ(made.available(), 64);
}

TEST(SoftwareSerialLine, OnePortListensAtATime) {
    SoftwareSerial first(kReceive, kTransmit), second(kWitness, 13);
    first.begin(9600);
    EXPECT_TRUE(first.isListening());
    second.begin(9600);
    EXPECT_FALSE(first.isListening());
    EXPECT_TRUE(second.isListening());
    EXPECT_FALSE(second.listen());
    EXPECT_TRUE(first.listen());
    EXPECT_FALSE(second.stopListening());
    EXPECT_TRUE(first.stopListening());
    EXPECT_FALSE(first.isListening());
    first.begin(1);  // refused: reported, nothing changed
    EXPECT_FALSE(first.isListening());
}

}  // namespace
}  // namespace software_serial_test
