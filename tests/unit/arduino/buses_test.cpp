// Wire and SPI: the very transactions that reach the board.
#include "arduino/SPI.h"
#include "arduino/Wire.h"
#include "tests/unit/arduino/arduino_fixture.h"

using qduino::fake::I2cTransaction;
using Bytes = std::vector<std::uint8_t>;

namespace buses_test {
namespace {

class ArduinoWire : public ArduinoTest {
  protected:
    void TearDown() override {
        Wire.end();
        ArduinoTest::TearDown();
    }
};
class ArduinoSpi : public ArduinoTest {};

TEST_F(ArduinoWire, AWriteIsOneTransaction) {
    Wire.begin();
    Wire.beginTransmission(0x48);
    Wire.write(0x84);
    Wire.write("ab");
    EXPECT_TRUE(board().i2c.empty()) << "nothing is sent before the end";
    EXPECT_EQ(Wire.endTransmission(), 0);
    EXPECT_EQ(board().i2c, (std::vector<I2cTransaction>{{0, 0x48, Bytes{0x84, 'a', 'b'}, 0}}));
}

TEST_F(ArduinoWire, ARegisterReadIsOneCombinedTransaction) {
    board().chip = [](const I2cTransaction&, std::span<std::uint8_t> in) {
        in[0] = 0x0a;
        in[1] = 0xbc;
        return true;
    };
    Wire.beginTransmission(0x48);
    Wire.write(0x8c);
    EXPECT_EQ(Wire.endTransmission(false), 0);
    EXPECT_EQ(Wire.requestFrom(0x48, 2), 2U);
    EXPECT_EQ(board().i2c, (std::vector<I2cTransaction>{{0, 0x48, Bytes{0x8c}, 2}}));
    EXPECT_EQ(Wire.available(), 2);
    EXPECT_EQ(Wire.peek(), 0x0a);
    EXPECT_EQ(Wire.read(), 0x0a);
    EXPECT_EQ(Wire.read(), 0xbc);
    EXPECT_EQ(Wire.read(), -1);
}

TEST_F(ArduinoWire, TheRegisterFormOfRequestFrom) {
    EXPECT_EQ(Wire.requestFrom(0x50, 4, 0x0102, 2, true), 4U);
    EXPECT_EQ(board().i2c, (std::vector<I2cTransaction>{{0, 0x50, Bytes{1, 2}, 4}}));
}

TEST_F(ArduinoWire, WhatWasKeptForNobodyIsSentFirst) {
    Wire.beginTransmission(0x20);
    Wire.write(7);
    Wire.endTransmission(false);
    EXPECT_EQ(Wire.requestFrom(0x21, 1), 1U);
    EXPECT_EQ(board().i2c, (std::vector<I2cTransaction>{{0, 0x20, Bytes{7}, 0}, {0, 0x21, Bytes{}, 1}}));
    Wire.beginTransmission(0x20);
    Wire.write(8);
    Wire.endTransmission(false);
    Wire.beginTransmission(0x20);
    EXPECT_EQ(board().i2c.size(), 3U);
    Wire.endTransmission();
    EXPECT_EQ(board().i2c.size(), 4U);
}

TEST_F(ArduinoWire, NobodyAnswers) {
    board().chip = [](const I2cTransaction&, std::span<std::uint8_t>) { return false; };
    Wire.beginTransmission(0x11);
    EXPECT_EQ(Wire.endTransmission(), 2);
    EXPECT_EQ(Wire.requestFrom(0x11, 3), 0U);
    EXPECT_EQ(Wire.available(), 0);
    EXPECT_FALSE(Wire.getWireTimeoutFlag()) << "nobody held the bus";
    EXPECT_TRUE(errors().empty()) << "a scan of the bus is not an error";
}

TEST_F(ArduinoWire, AFaultIsFourAndReported) {
    board().refuse_everything = true;
    Wire.beginTransmission(0x11);
    EXPECT_EQ(Wire.endTransmission(), 4);
    EXPECT_EQ(errors(), std::vector<std::string>{"Wire(17)"});
}

TEST_F(ArduinoWire, TooLongIsSaidAndNotSent) {
    Wire.beginTransmission(0x11);
    const Bytes many(300, 0x55);
    EXPECT_EQ(Wire.write(many.data(), many.size()), BUFFER_LENGTH);
    EXPECT_EQ(Wire.write(1), 0U);
    EXPECT_EQ(Wire.endTransmission(), 1);
    EXPECT_TRUE(board().i2c.empty());
    EXPECT_EQ(Wire.write(1), 0U) << "outside of a transmission nothing is taken";
    EXPECT_EQ(Wire.requestFrom(0x11, 9999), BUFFER_LENGTH);
}

TEST_F(ArduinoWire, LoopsDoNotMixTheirBytes) {
    // Two loops of one core, each interrupted by the other in the middle of its transaction.
    board().vcpu = 1;
    Wire.beginTransmission(0x31);
    Wire.write(1);
    board().vcpu = 2;
    Wire.beginTransmission(0x32);
    Wire.write(2);
    board().vcpu = 1;
    Wire.write(11);
    EXPECT_EQ(Wire.endTransmission(), 0);
    board().vcpu = 2;
    Wire.write(22);
    EXPECT_EQ(Wire.endTransmission(), 0);
    EXPECT_EQ(board().i2c,
              (std::vector<I2cTransaction>{{0, 0x31, Bytes{1, 11}, 0}, {0, 0x32, Bytes{2, 22}, 0}}));
    Wire.end();
    board().vcpu = 1;
}

TEST_F(ArduinoWire, BeingAddressedIsRefusedAloud) {
    Wire.begin(8);
    Wire.onReceive(nullptr);
    EXPECT_EQ(errors(), (std::vector<std::string>{"Wire.begin(8)", "Wire.onReceive(0)"}));
}

TEST_F(ArduinoSpi, BytesGoBothWaysWithTheSettings) {
    qduino::board::SpiSettings seen;
    board().spi_device = [&](qduino::board::SpiSettings settings, std::span<std::uint8_t> data) {
        seen = settings;
        for (auto& value : data) value = static_cast<std::uint8_t>(~value);
    };
    SPI.begin();
    SPI.beginTransaction(SPISettings(1'000'000, LSBFIRST, SPI_MODE3));
    EXPECT_EQ(SPI.transfer(0x0f), 0xf0);
    EXPECT_EQ(seen.clock_hz, 1'000'000U);
    EXPECT_EQ(seen.mode, 3);
    EXPECT_TRUE(seen.least_significant_first);
    std::uint8_t buffer[] = {1, 2, 3};
    SPI.transfer(buffer, sizeof buffer);
    EXPECT_EQ(buffer[2], 0xfc);
    SPI.endTransaction();
    SPI.setClockDivider(SPI_CLOCK_DIV16);
    SPI.transfer(0);
    EXPECT_EQ(seen.clock_hz, 1'000'000U);
    board().refuse_everything = true;
    EXPECT_EQ(SPI.transfer(0), 0xff);
    EXPECT_EQ(errors(), std::vector<std::string>{"SPI.transfer(0)"});
}

TEST_F(ArduinoSpi, SixteenBitsInTheOrderOfTheSettings) {
    Bytes sent;
    board().spi_device = [&](auto, std::span<std::uint8_t> data) { sent.assign(data.begin(), data.end()); };
    SPI.beginTransaction(SPISettings(1'000'000, MSBFIRST, SPI_MODE0));
    EXPECT_EQ(SPI.transfer16(0x1234), 0x1234);
    EXPECT_EQ(sent, (Bytes{0x12, 0x34}));
    SPI.endTransaction();
    SPI.beginTransaction(SPISettings(1'000'000, LSBFIRST, SPI_MODE0));
    EXPECT_EQ(SPI.transfer16(0x1234), 0x1234);
    EXPECT_EQ(sent, (Bytes{0x34, 0x12}));
    SPI.endTransaction();
}

TEST_F(ArduinoSpi, ATransactionHoldsTheBusAndAWaiterSleeps) {
    board().vcpu = 1;
    SPI.beginTransaction(SPISettings());
    board().vcpu = 2;
    // The first loop runs on meanwhile, and ends its transaction at 1 ms.
    board().while_sleeping = [] {
        if (qduino::to_ns(qduino::fake::state().now) < 1'000'000) return;
        qduino::fake::state().while_sleeping = [] {};
        qduino::fake::state().vcpu = 1;
        SPI.endTransaction();
        qduino::fake::state().vcpu = 2;
    };
    SPI.transfer(1);
    EXPECT_GE(qduino::to_ns(board().now), 1'000'000);
    EXPECT_LE(qduino::to_ns(board().now), 1'020'000) << "a look of the fake board later";
    EXPECT_EQ(board().spun_ns, 0);
}

}  // namespace
}  // namespace buses_test
