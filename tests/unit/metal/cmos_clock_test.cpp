// The clock of a PC in front of a chip that is written here by the data sheet, and counts on while
// it is read.
#include "board/metal/driver/cmos_clock.h"

#include <gtest/gtest.h>

#include <chrono>
#include <random>

namespace qduino::board::metal::cmos_clock_test {
namespace {

constexpr std::uint8_t kCentury = 0x32;

/// An MC146818 as its data sheet has it. Time passes by reads: after so many it counts a second on.
struct Chip {
    std::int64_t seconds = 0;  // since 1970
    bool binary = false, of_24 = true, held = true, stuck = false;
    int reads_to_update = 1'000'000;  // of which the last few say that it counts on
    int reads_of_update = 20;

    [[nodiscard]] std::uint8_t number(unsigned value) const {
        return static_cast<std::uint8_t>(binary ? value : value / 10 * 16 + value % 10);
    }
    [[nodiscard]] std::uint8_t hour() const {
        const auto of_day = static_cast<unsigned>((seconds % 86'400 + 86'400) % 86'400 / 3600);
        if (of_24) return number(of_day);
        const unsigned twelve = of_day % 12 == 0 ? 12 : of_day % 12;
        return static_cast<std::uint8_t>(number(twelve) | (of_day >= 12 ? 0x80 : 0));
    }
    [[nodiscard]] std::uint8_t shown(std::uint8_t which) const {
        const std::int64_t of_day = (seconds % 86'400 + 86'400) % 86'400;
        const std::chrono::sys_days day{std::chrono::days{(seconds - of_day) / 86'400}};
        const std::chrono::year_month_day date{day};
        const auto year = static_cast<unsigned>(static_cast<int>(date.year()));
        switch (which) {
            case 0:
                return number(static_cast<unsigned>(of_day % 60));
            case 2:
                return number(static_cast<unsigned>(of_day / 60 % 60));
            case 4:
                return hour();
            case 7:
                return number(static_cast<unsigned>(date.day()));
            case 8:
                return number(static_cast<unsigned>(date.month()));
            case 9:
                return number(year % 100);
            case kCentury:
                return number(year / 100);
            case 10:
                return static_cast<std::uint8_t>(0x26 |
                                                 (stuck || reads_to_update < reads_of_update ? 0x80 : 0));
            case 11:
                return static_cast<std::uint8_t>((binary ? 4 : 0) | (of_24 ? 2 : 0));
            case 13:
                return held ? 0x80 : 0;
            default:
                return 0;
        }
    }
    /// While it counts on its numbers are "undefined": here digits that are none.
    std::uint8_t read(std::uint8_t which) {
        const bool counts_on = reads_to_update < reads_of_update;
        const std::uint8_t value = counts_on && which < 10 ? 0xff : shown(which);
        if (--reads_to_update == 0) {
            ++seconds;
            reads_to_update = 1'000'000;
        }
        return value;
    }
};

Chip chip;
std::uint8_t read_chip(std::uint8_t number) { return chip.read(number); }

constexpr std::int64_t kBefore2000 = 946'684'799;   // 1999-12-31T23:59:59Z
constexpr std::int64_t kLeapNight = 1'709'251'199;  // 2024-02-29T23:59:59Z

TEST(CmosClock, SaysEveryDateInEachOfItsForms) {
    std::mt19937_64 random{20260228};
    for (int i = 0; i < 4000; ++i) {
        const std::int64_t seconds = i == 0   ? kBefore2000
                                     : i == 1 ? kLeapNight
                                              : static_cast<std::int64_t>(random() % 4'102'444'800u);
        for (const bool binary : {false, true}) {
            for (const bool of_24 : {false, true}) {
                chip = {.seconds = seconds, .binary = binary, .of_24 = of_24};
                ASSERT_EQ(read_cmos_date(read_chip, kCentury), seconds) << binary << of_24;
            }
        }
    }
}

TEST(CmosClock, WithoutACenturyItIsThisOne) {
    chip = {.seconds = kLeapNight};
    EXPECT_EQ(read_cmos_date(read_chip, 0), kLeapNight);
}

TEST(CmosClock, IsNeverReadInTwoHalves) {
    // Midnight at the end of a leap day, at every place of a reading.
    for (int reads = 1; reads < 60; ++reads) {
        chip = {.seconds = kLeapNight, .reads_to_update = reads, .reads_of_update = 0};
        const auto date = read_cmos_date(read_chip, kCentury);
        EXPECT_TRUE(date == kLeapNight || date == kLeapNight + 1) << reads;
        chip = {.seconds = kLeapNight, .reads_to_update = reads, .reads_of_update = 25};
        const auto slow = read_cmos_date(read_chip, kCentury);
        EXPECT_TRUE(slow == kLeapNight || slow == kLeapNight + 1) << reads;
    }
}

TEST(CmosClock, WithoutAClockThereIsNoDate) {
    EXPECT_EQ(read_cmos_date([](std::uint8_t) { return std::uint8_t{0xff}; }, kCentury), std::nullopt);
    EXPECT_EQ(read_cmos_date([](std::uint8_t) { return std::uint8_t{0}; }, kCentury), std::nullopt);
    chip = {.seconds = kLeapNight, .stuck = true};
    EXPECT_EQ(read_cmos_date(read_chip, kCentury), std::nullopt) << "it counts on for ever";
    chip = {.seconds = kLeapNight, .held = false};
    EXPECT_EQ(read_cmos_date(read_chip, kCentury), std::nullopt) << "its battery was empty";
}

/// The date in which register `which` holds `value`, in binary.
std::uint8_t wrong_at, wrong_value;
std::optional<std::int64_t> date_with(std::uint8_t which, std::uint8_t value, bool binary = true) {
    chip = {.seconds = kLeapNight, .binary = binary};
    wrong_at = which;
    wrong_value = value;
    return read_cmos_date([](std::uint8_t at) { return at == wrong_at ? wrong_value : read_chip(at); },
                          kCentury);
}

TEST(CmosClock, WhatIsNoDateIsNone) {
    EXPECT_NE(date_with(0, 59), std::nullopt);
    for (const auto& [which, value] : std::initializer_list<std::pair<int, int>>{{0, 60},
                                                                                 {2, 60},
                                                                                 {4, 24},
                                                                                 {7, 0},
                                                                                 {7, 30},
                                                                                 {8, 0},
                                                                                 {8, 13},
                                                                                 {9, 100},
                                                                                 {kCentury, 0},
                                                                                 {kCentury, 99}}) {
        EXPECT_EQ(date_with(static_cast<std::uint8_t>(which), static_cast<std::uint8_t>(value)), std::nullopt)
            << which << " " << value;
    }
    EXPECT_EQ(date_with(0, 0x5a, false), std::nullopt) << "no digit";
    EXPECT_EQ(date_with(9, 25), std::nullopt) << "no 29 February in 2025";
}

}  // namespace
}  // namespace qduino::board::metal::cmos_clock_test
