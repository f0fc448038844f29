// The DS18B20's side of the 1-Wire bus, against a master that follows the data sheet's slots.
#include "device/ds18b20_chip.h"

#include <gtest/gtest.h>

#include <memory>
#include <set>
#include <vector>

#include "device/one_wire_crc.h"

namespace qduino::device::ds18b20_test {
namespace {

using Rom = std::array<std::uint8_t, 8>;

/// A bus with chips on it, and its master.
class Bus {
  public:
    Ds18b20Chip& add(std::uint64_t serial, double celsius) {
        chips_.push_back(std::make_unique<Ds18b20Chip>(serial, celsius));
        return *chips_.back();
    }
    void drive(bool high) {
        for (auto& chip : chips_) chip->master(now, high);
    }
    [[nodiscard]] bool high() const {
        bool level = true;
        for (const auto& chip : chips_) level = level && !chip->pulls(now);
        return level;
    }
    /// True: somebody is there.
    bool reset(Nanoseconds low = 480us) {
        drive(false);
        now += low;
        drive(true);
        now += 70us;
        const bool present = !high();
        now += 410us;
        EXPECT_TRUE(high());
        return present;
    }
    void write_bit(bool bit) {
        drive(false);
        now += bit ? 6us : 65us;
        drive(true);
        now += bit ? 64us : 5us;
    }
    bool read_bit() {
        drive(false);
        now += 3us;
        drive(true);
        now += 10us;
        const bool bit = high();
        now += 57us;
        return bit;
    }
    void write(std::initializer_list<unsigned> bytes) {
        for (const unsigned byte : bytes)
            for (int i = 0; i < 8; ++i) write_bit((byte >> i & 1) != 0);
    }
    std::uint8_t read() {
        unsigned byte = 0;
        for (int i = 0; i < 8; ++i) byte |= unsigned{read_bit()} << i;
        return static_cast<std::uint8_t>(byte);
    }
    template <std::size_t N>
    std::array<std::uint8_t, N> read_bytes() {
        std::array<std::uint8_t, N> bytes;
        for (std::uint8_t& byte : bytes) byte = read();
        return bytes;
    }
    /// All addresses on the bus, by walking the tree of their bits.
    std::set<Rom> search(unsigned command = 0xF0) {
        std::set<Rom> found;
        std::vector<std::vector<bool>> ways{{}};
        while (!ways.empty()) {
            std::vector<bool> way = ways.back();
            ways.pop_back();
            if (!reset()) return found;
            write({command});
            Rom rom{};
            for (std::size_t i = 0; i < 64; ++i) {
                const bool zero_missing = read_bit(), one_missing = read_bit();
                if (zero_missing && one_missing) return found;
                if (i >= way.size()) {
                    if (!zero_missing && !one_missing) {
                        ways.push_back(way);
                        ways.back().push_back(true);
                    }
                    way.push_back(zero_missing);
                }
                write_bit(way[i]);
                rom[i / 8] = static_cast<std::uint8_t>(rom[i / 8] | (way[i] ? 1 << (i % 8) : 0));
            }
            found.insert(rom);
        }
        return found;
    }
    /// Degrees, in sixteenths, of the only chip.
    int temperature() {
        reset();
        write({0xCC, 0xBE});
        const auto bytes = read_bytes<9>();
        EXPECT_EQ(one_wire_crc(bytes), 0);
        return static_cast<std::int16_t>(bytes[0] | bytes[1] << 8);
    }
    void convert(Nanoseconds wait = 750ms) {
        reset();
        write({0xCC, 0x44});
        now += wait;
    }
    Instant now = kEpoch + 1s;

  private:
    std::vector<std::unique_ptr<Ds18b20Chip>> chips_;
};

TEST(Ds18b20, TheCrcIsThatOfTheApplicationNote) {
    // Maxim, application note 27: the ROM 02 1C B8 01 00 00 00 has the CRC A2.
    const std::array<std::uint8_t, 8> rom{0x02, 0x1C, 0xB8, 0x01, 0, 0, 0, 0xA2};
    EXPECT_EQ(one_wire_crc(std::span(rom).first(7)), 0xA2);
    EXPECT_EQ(one_wire_crc(rom), 0);
}

TEST(Ds18b20, AnswersAResetAndNoShorterPulse) {
    Bus bus;
    EXPECT_FALSE(bus.reset()) << "nobody is there";
    Ds18b20Chip& chip = bus.add(1, 20);
    EXPECT_TRUE(bus.reset());
    EXPECT_EQ(chip.unclear_slots(), 0u);
    EXPECT_FALSE(bus.reset(300us));
    EXPECT_EQ(chip.unclear_slots(), 1u);
}

TEST(Ds18b20, ReadsItsAddress) {
    Bus bus;
    bus.add(0x0605'0403'0201, 20);
    bus.reset();
    bus.write({0x33});
    const Rom rom = bus.read_bytes<8>();
    EXPECT_EQ(rom[0], 0x28);
    for (std::size_t i = 1; i <= 6; ++i) EXPECT_EQ(rom[i], i);
    EXPECT_EQ(one_wire_crc(rom), 0);
}

TEST(Ds18b20, ASearchFindsEveryChip) {
    Bus bus;
    std::set<Rom> there;
    for (const std::uint64_t serial :
         {0ull, 1ull, 2ull, 0x8000'0000'0000ull, 0xFFFF'FFFF'FFFFull, 0x5555'5555'5555ull})
        there.insert(bus.add(serial, 20).rom());
    EXPECT_EQ(bus.search(), there);
    Bus empty;
    EXPECT_TRUE(empty.search().empty());
}

// The data sheet's table 1, in sixteenths of a degree.
TEST(Ds18b20, MeasuresAsTheDataSheetsTable) {
    const std::pair<double, int> table[] = {{125, 0x07D0},    {85, 0x0550},       {25.0625, 0x0191},
                                            {10.125, 0x00A2}, {0.5, 0x0008},      {0, 0},
                                            {-0.5, -0x0008},  {-10.125, -0x00A2}, {-55, -0x0370}};
    for (const auto& [celsius, steps] : table) {
        Bus bus;
        bus.add(7, celsius);
        EXPECT_EQ(bus.temperature(), 0x0550) << "85 degrees, until the first conversion";
        bus.convert();
        EXPECT_EQ(bus.temperature(), steps) << celsius;
    }
}

TEST(Ds18b20, AConversionTakesItsTime) {
    Bus bus;
    Ds18b20Chip& chip = bus.add(7, 21);
    bus.convert(100ms);
    EXPECT_FALSE(bus.read_bit()) << "busy";
    bus.now += 640ms;
    EXPECT_FALSE(bus.read_bit());
    bus.now += 11ms;
    EXPECT_TRUE(bus.read_bit());
    EXPECT_EQ(chip.conversions(), 1u);
    bus.convert(10ms);
    EXPECT_EQ(bus.temperature(), 21 * 16) << "the old one, while the new one is made";
    EXPECT_EQ(chip.conversions(), 1u);
    EXPECT_EQ(chip.unclear_slots(), 0u);
}

TEST(Ds18b20, FewerBitsTakeLessTime) {
    Bus bus;
    bus.add(7, 21.9375);
    bus.reset();
    bus.write({0xCC, 0x4E, 30, 10, 0x1F});  // nine bits
    bus.convert(94ms);
    EXPECT_TRUE(bus.read_bit());
    EXPECT_EQ(bus.temperature(), 21 * 16 + 8) << "in steps of half a degree";
    bus.reset();
    bus.write({0xCC, 0xBE});
    const auto bytes = bus.read_bytes<9>();
    EXPECT_EQ(bytes[2], 30);
    EXPECT_EQ(bytes[3], 10);
    EXPECT_EQ(bytes[4], 0x1F);
}

TEST(Ds18b20, OnlyTheChipThatIsMeantAnswers) {
    Bus bus;
    const Rom first = bus.add(1, 10).rom(), second = bus.add(2, 20).rom();
    bus.convert();
    for (const auto& [rom, degrees] : {std::pair{first, 10}, std::pair{second, 20}}) {
        bus.reset();
        bus.write({0x55});
        for (const std::uint8_t byte : rom) bus.write({byte});
        bus.write({0xBE});
        EXPECT_EQ(bus.read(), degrees * 16 & 0xFF);
        EXPECT_EQ(bus.read(), degrees * 16 >> 8);
    }
}

TEST(Ds18b20, AlarmsAndWhatIsKept) {
    Bus bus;
    const Rom hot = bus.add(1, 90).rom();
    bus.add(2, 20);
    bus.reset();
    bus.write({
        0xCC,
        0x4E,
        70,
        0xF6,
        0x7F,
    });  // alarm from 70 and to −10 degrees
    bus.convert();
    EXPECT_EQ(bus.search(0xEC), std::set<Rom>{hot});
    bus.reset();
    bus.write({0xCC, 0x48});  // keep them
    bus.reset();
    bus.write({0xCC, 0x4E, 1, 2, 0x1F});
    bus.reset();
    bus.write({0xCC, 0xB8});  // back to what was kept
    EXPECT_EQ(bus.search(0xEC), std::set<Rom>{hot});
    bus.reset();
    bus.write({0xCC, 0xB4});
    EXPECT_TRUE(bus.read_bit()) << "has power of its own";
}

}  // namespace
}  // namespace qduino::device::ds18b20_test
