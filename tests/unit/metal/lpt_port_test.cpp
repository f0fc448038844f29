#include "board/metal/driver/lpt_port.h"

#include <gtest/gtest.h>

#include <array>
#include <random>

namespace qduino::board::metal::lpt_port_test {
namespace {

constexpr std::uint16_t kBase = 0x278;
std::array<std::uint8_t, 3> registers;

const PortAccess kMemory{
    .write = [](std::uint16_t port, std::uint8_t value) { registers.at(port - kBase) = value; },
    .read = [](std::uint16_t port) { return registers.at(port - kBase); }};
const PortAccess kNobody{.write = [](std::uint16_t, std::uint8_t) {},
                         .read = [](std::uint16_t) { return std::uint8_t{0xff}; }};

class LptPortTest : public testing::Test {
  protected:
    void SetUp() override {
        registers.fill(0xff);
        ASSERT_TRUE(port.open());
    }
    /// Pin by pin, what the connector has: the three inverters of the control register undone.
    static bool connector(int pin) {
        const int control = registers[2] ^ 0b1011;
        switch (pin) {
            case 1:
                return (control & 1) != 0;
            case 14:
                return (control & 2) != 0;
            case 16:
                return (control & 4) != 0;
            case 17:
                return (control & 8) != 0;
            default:
                return (registers[0] >> (pin - 2) & 1) != 0;
        }
    }

    LptPort port{kMemory, kBase};
};

constexpr std::array<std::uint16_t, 12> kOutputs{1, 2, 3, 4, 5, 6, 7, 8, 9, 14, 16, 17};

TEST_F(LptPortTest, BeginsLowWithoutInterruptAndWithDataLinesThatAreOutputs) {
    for (const std::uint16_t pin : kOutputs) EXPECT_FALSE(connector(pin)) << pin;
    EXPECT_EQ(registers[2] & 0b11'0000, 0);
}

TEST_F(LptPortTest, IsNotThereWhereNobodyAnswers) {
    LptPort nobody(kNobody, kBase);
    EXPECT_FALSE(nobody.open());
}

TEST_F(LptPortTest, AnyWritesLeaveTheOtherPinsAsTheyWere) {
    std::mt19937 random(14);
    std::array<bool, 18> expected{};
    for (int i = 0; i < 2000; ++i) {
        const std::uint16_t pin = kOutputs[random() % kOutputs.size()];
        expected[pin] = (random() & 1) != 0;
        port.write(PinId{pin}, expected[pin] ? Level::high : Level::low);
        for (const std::uint16_t other : kOutputs) ASSERT_EQ(connector(other), expected[other]) << other;
        ASSERT_EQ(port.read(PinId{pin}), expected[pin] ? Level::high : Level::low);
    }
}

TEST_F(LptPortTest, ReadsItsFiveInputs) {
    constexpr std::array<std::uint16_t, 5> kInputs{15, 13, 12, 10, 11};  // from bit 3 on
    for (unsigned bit = 3; bit < 8; ++bit) {
        registers[1] = static_cast<std::uint8_t>(1u << bit);
        for (unsigned i = 0; i < kInputs.size(); ++i) {
            const bool inverted = kInputs[i] == 11;
            EXPECT_EQ(port.read(PinId{kInputs[i]}) == Level::high, (i + 3 == bit) != inverted) << kInputs[i];
        }
    }
}

TEST_F(LptPortTest, RefusesWhatThePortCannotDo) {
    const auto before = registers;
    EXPECT_EQ(port.set_mode(PinId{0}, PinMode::output, Level::high).error().code, ErrorCode::not_found);
    EXPECT_EQ(port.set_mode(PinId{18}, PinMode::input, Level::high).error().code, ErrorCode::not_found);
    EXPECT_EQ(port.set_mode(PinId{2}, PinMode::input, Level::high).error().code, ErrorCode::unsupported);
    EXPECT_EQ(port.set_mode(PinId{10}, PinMode::output, Level::high).error().code, ErrorCode::unsupported);
    EXPECT_EQ(port.set_mode(PinId{2}, PinMode::output_open_drain, Level::high).error().code,
              ErrorCode::unsupported);
    port.write(PinId{10}, Level::high);
    port.write(PinId{99}, Level::high);
    EXPECT_EQ(registers, before);
}

TEST_F(LptPortTest, AnOutputHasItsLevelFromTheBeginning) {
    ASSERT_TRUE(port.set_mode(PinId{5}, PinMode::output, Level::high).ok());
    EXPECT_TRUE(connector(5));
}

TEST(PortLock, IsPassedByOneThatWaitsForeverForItsHolder) {
    PortLock lock;
    lock.lock();
    lock.lock();  // a panic's safe levels: the test ends
    lock.unlock();
}

}  // namespace
}  // namespace qduino::board::metal::lpt_port_test
