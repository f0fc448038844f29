// Parts on the wires of a simulated board: who pulls, who answers, and what is said in the end.
#include "config/parts.h"

#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "board/sim/sim_board.h"

namespace qduino::apps::parts_test {
namespace {

using board::Level;
using board::PinId;
using board::PinMode;

PartSpec thermometer(std::uint16_t pin, std::uint64_t serial) {
    PartSpec spec;
    spec.chip = Chip::ds18b20;
    spec.data = PinId{pin};
    spec.serial = serial;
    return spec;
}

/// A reset pulse on `pin` that ends in letting go of the line; is it low so long `after`?
struct Reset {
    board::Board* on;
    PinId pin;
    Nanoseconds after;
    bool low = false;
} reset;

void play_reset() {
    board::Board& board = *reset.on;
    EXPECT_TRUE(board.pin_mode(reset.pin, PinMode::output).ok());
    board.pin_write(reset.pin, Level::low);
    board.busy_until(board.now() + 500us);
    EXPECT_TRUE(board.pin_mode(reset.pin, PinMode::input).ok());
    board.busy_until(board.now() + reset.after);
    reset.low = board.pin_read(reset.pin) == Level::low;
}

bool present(PinId pin, Nanoseconds after) {
    Parts parts({thermometer(4, 1), thermometer(4, 2)});
    board::sim::SimBoard board({}, parts);
    reset = {&board, pin, after};
    EXPECT_TRUE(board.run_setup(play_reset, kForever));
    return reset.low;
}

TEST(Parts, ALineIsHighUnlessAPartPullsIt) {
    Parts parts({thermometer(4, 1)});
    EXPECT_EQ(parts.pin_level(kEpoch, PinId{4}), Level::high);
    EXPECT_EQ(parts.pin_level(kEpoch, PinId{5}), Level::low) << "nothing is wired there";
    EXPECT_FALSE(present(PinId{4}, 20us));
    EXPECT_TRUE(present(PinId{4}, 70us)) << "the line was let go, and the chips saw it";
    EXPECT_FALSE(present(PinId{4}, 200us));
}

TEST(Parts, AChipAnswersAtItsAddressAlone) {
    PartSpec display;
    display.chip = Chip::ssd1306;
    display.height = 32;
    display.picture = testing::TempDir() + "parts_test.pbm";
    Parts parts({display});
    const std::array<std::uint8_t, 4> on{0x00, 0xA1, 0xC8, 0xAF}, dots{0x40, 0x01, 0x80, 0x00};
    EXPECT_TRUE(parts.i2c_transfer(kEpoch, {0}, {0x3C}, on, {}).ok());
    EXPECT_TRUE(parts.i2c_transfer(kEpoch, {0}, {0x3C}, dots, {}).ok());
    EXPECT_FALSE(parts.i2c_transfer(kEpoch, {0}, {0x3D}, dots, {}).ok());
    EXPECT_FALSE(parts.i2c_transfer(kEpoch, {1}, {0x3C}, dots, {}).ok());
    EXPECT_EQ(parts.report(kEpoch),
              "ssd1306 at 0x3c of I2C 0: 2 of 4096 dots shine, 3 bytes of data; picture: " + display.picture +
                  "\n");
    ASSERT_TRUE(parts.finish().ok());
    std::ifstream file(display.picture);
    std::stringstream text;
    text << file.rdbuf();
    std::string expected = "P1\n128 32\n";
    for (int y = 0; y < 32; ++y) {
        std::string row(128, '0');
        if (y == 0) row[0] = '1';
        if (y == 7) row[1] = '1';
        expected += row + "\n";
    }
    EXPECT_EQ(text.str(), expected);
    std::filesystem::remove(display.picture);
    display.picture = "";
    EXPECT_EQ(Parts({display}).report(kEpoch),
              "ssd1306 at 0x3c of I2C 0: 0 of 4096 dots shine, 0 bytes of data, switched off\n");
    display.picture = "/proc/nowhere/x.pbm";
    EXPECT_FALSE(Parts({display}).finish().ok());
}

TEST(Parts, TheBitsOfSpiReachAStripOnItsPin) {
    PartSpec strip;
    strip.chip = Chip::ws2812;
    strip.data = PinId{51};
    strip.pixels = 1;
    Parts parts({strip});
    // 0x00FF01, three bits for one: 0 is 100, 1 is 110.
    std::array<std::uint8_t, 10> wave{0x92, 0x49, 0x24, 0xDB, 0x6D, 0xB6, 0x92, 0x49, 0x26, 0};
    EXPECT_TRUE(parts.spi_transfer(kEpoch, {0}, {.clock_hz = 2'400'000}, wave).ok());
    EXPECT_EQ(parts.report(kEpoch + 60us), "ws2812 on pin 51: 0 frames; shows 000000\n");
    EXPECT_EQ(parts.report(kEpoch + 1ms), "ws2812 on pin 51: 1 frames; shows ff0001\n");
    EXPECT_TRUE(parts.spi_transfer(kEpoch + 2ms, {0}, {.clock_hz = 1'000'000}, wave).ok());
    EXPECT_EQ(parts.report(kEpoch + 3ms),
              "ws2812 on pin 51: 2 frames; shows ffffff; 24 pulses that are neither a 0 nor a 1\n");
}

TEST(Parts, EachSaysWhatItDid) {
    PartSpec cell;
    cell.data = PinId{2};
    cell.clock = PinId{3};
    Parts parts({cell, thermometer(4, 0x102)});
    parts.pin_written(kEpoch, PinId{3}, Level::high);
    parts.pin_written(kEpoch + 1ms, PinId{3}, Level::low);
    for (const auto& [at, level] : {std::pair{2000us, Level::low}, std::pair{2030us, Level::high}})
        parts.pin_written(kEpoch + at, PinId{4}, level);
    EXPECT_EQ(parts.report(kEpoch + 1s),
              "hx711 on pins 2 and 3: 0 results read, switched off 1 times; the next is of input A at 128\n"
              "ds18b20 28020100000000bd on pin 4: 0 conversions, 1 slots of a length that is neither a 0 nor "
              "a 1\n");
    EXPECT_EQ(Parts({}).report(kEpoch), "");
}

}  // namespace
}  // namespace qduino::apps::parts_test
