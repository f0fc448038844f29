// What the witnesses at a machine's pins leave: bytes, a log with times, and the dump that is made
// of them.
#include "qduino/trace/pin_record.h"

#include <gtest/gtest.h>

#include <map>
#include <sstream>

namespace qduino::apps::pin_record_test {
namespace {

constexpr std::string_view kLog =
    "00000000000i[      ] Bochs x86 Emulator 2.7\n"
    "00000001234d[UNMAP ] unmapped: 8-bit read from 02e8 = ff\n"
    "00000001250d[UNMAP ] unmapped: 8-bit write to 02e8 = 6\n"
    "00000001300d[UNMAP ] unmapped: 8-bit write to 02e8 = 86\n"
    "00000001301d[UNMAP ] unmapped: 8-bit write to 02e9 = 86\n"
    "123456789012d[UNMAP ] unmapped: 8-bit write to 02e8 = ff\n"
    "00000001302d[UNMAP ] unmapped: 8-bit write to 00f4 = 2\n"
    "00000001302d[UNMAP ] unmapped: 8-bit write to 02e8 = ";

TEST(PinRecord, ALogGivesEachWriteToThePinsPortWithItsTime) {
    const BochsLog read = read_bochs_log(kLog, 50);
    EXPECT_EQ(read.writes,
              (std::vector<PinWrite>{{62'500, 6, false}, {65'000, 6, true}, {6'172'839'450'600, 127, true}}));
    EXPECT_EQ(read.status, 2);
    EXPECT_FALSE(read_bochs_log("", 50).status);
}

TEST(PinRecord, EveryByteIsOneWrite) {
    std::string bytes;
    for (int value = 0; value < 256; ++value) bytes.push_back(static_cast<char>(value));
    EXPECT_EQ(bytes_of(writes_of(bytes)), bytes);
}

TEST(PinRecord, TheTableCountsWritesAndRises) {
    const std::string table = pins_table(writes_of("\x06\x86\x86\x06\x86\x87"));
    EXPECT_NE(table.find("  6          5        2  high\n"), std::string::npos) << table;
    EXPECT_NE(table.find("  7          1        1  high\n"), std::string::npos) << table;
}

/// Reads a dump as a viewer does: the changes, in order, with their times.
std::vector<PinWrite> read_dump(const std::string& dump) {
    std::istringstream lines(dump);
    std::map<std::string, std::uint8_t> pins;
    std::vector<PinWrite> changes;
    std::int64_t now = 0;
    for (std::string line; std::getline(lines, line);) {
        if (line.starts_with("$var")) {
            std::istringstream words(line);
            std::string var, wire, width, code, name;
            words >> var >> wire >> width >> code >> name;
            EXPECT_TRUE(pins.emplace(code, static_cast<std::uint8_t>(std::stoi(name.substr(3)))).second)
                << code;
        } else if (line[0] == '#') {
            EXPECT_GE(std::stoll(line.substr(1)), now);
            now = std::stoll(line.substr(1));
        } else if (line[0] == '0' || line[0] == '1') {
            changes.push_back({now, pins.at(line.substr(1)), line[0] == '1'});
        }
    }
    return changes;
}

TEST(PinRecord, ADumpHasEveryChangeAndNothingElse) {
    std::vector<PinWrite> writes, changes;
    std::map<int, bool> levels;
    std::uint32_t random = 7;
    for (std::int64_t now = 0; writes.size() < 5000;) {
        random = random * 1664525 + 1013904223;  // Numerical Recipes' generator
        now += random >> 29;                     // often the same instant
        writes.push_back({now, static_cast<std::uint8_t>(random >> 8 & 0x7f), (random >> 16 & 1) != 0});
        const auto [level, first] = levels.try_emplace(writes.back().pin, writes.back().high);
        if (first || level->second != writes.back().high) changes.push_back(writes.back());
        level->second = writes.back().high;
    }
    EXPECT_EQ(read_dump(value_change_dump(writes)), changes);
    EXPECT_NE(value_change_dump(writes).find("$timescale 1 ns $end"), std::string::npos);
}

}  // namespace
}  // namespace qduino::apps::pin_record_test
