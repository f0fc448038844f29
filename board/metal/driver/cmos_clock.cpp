#include "board/metal/driver/cmos_clock.h"

#include <chrono>

namespace qduino::board::metal {
namespace {

constexpr std::uint8_t kSeconds = 0, kMinutes = 2, kHours = 4, kDay = 7, kMonth = 8, kYear = 9,
                       kRegisterA = 10, kRegisterB = 11, kRegisterD = 13;
constexpr std::uint8_t kAfternoon = 0x80;  // of hours

/// As the registers have them.
struct Reading {
    std::uint8_t second, minute, hour, day, month, year, century;

    bool operator==(const Reading&) const = default;
};

/// False: it never rests, so there is none. A port without a device reads as ones.
bool rests(ReadCmos read) {
    constexpr std::uint8_t kCountsOn = 0x80;
    constexpr int kLooks = 20'000;  // a read takes a microsecond, an update 2.2 ms
    for (int look = 0; look < kLooks; ++look) {
        if ((read(kRegisterA) & kCountsOn) == 0) return true;
    }
    return false;
}

std::optional<Reading> read_between_updates(ReadCmos read, std::uint8_t century) {
    if (!rests(read)) return std::nullopt;
    return Reading{read(kSeconds),
                   read(kMinutes),
                   read(kHours),
                   read(kDay),
                   read(kMonth),
                   read(kYear),
                   century != 0 ? read(century) : std::uint8_t{0}};
}

/// An emulator may stop the computer for any time between two reads: so equal readings are asked
/// for, and not a short way from the look to the last read.
std::optional<Reading> read_twice(ReadCmos read, std::uint8_t century) {
    constexpr int kTries = 10;
    std::optional<Reading> last = read_between_updates(read, century);
    for (int i = 0; last && i < kTries; ++i) {
        const std::optional<Reading> next = read_between_updates(read, century);
        if (next == last) return last;
        last = next;
    }
    return std::nullopt;
}

/// Two decimal digits in one byte; 100, which no register may hold, where one is no digit.
unsigned from_digits(std::uint8_t byte) {
    const unsigned tens = byte >> 4u, ones = byte & 15u;
    return tens > 9 || ones > 9 ? 100 : 10 * tens + ones;
}

/// 0 to 23; 24, which is no hour, where it is none.
unsigned hour_of(unsigned hour, bool of_24, bool afternoon) {
    if (of_24) return hour;
    if (hour < 1 || hour > 12) return 24;
    return hour % 12 + (afternoon ? 12 : 0);
}

}  // namespace

std::optional<std::int64_t> read_cmos_date(ReadCmos read, std::uint8_t century) {
    constexpr std::uint8_t kBinary = 4, kOf24 = 2, kHeld = 0x80, kAlwaysZero = 0x40;
    if ((read(kRegisterD) & (kHeld | kAlwaysZero)) != kHeld) return std::nullopt;
    const std::optional<Reading> raw = read_twice(read, century);
    if (!raw) return std::nullopt;
    const std::uint8_t form = read(kRegisterB);
    const auto number = [form](std::uint8_t byte) {
        return (form & kBinary) != 0 ? byte : from_digits(byte);
    };
    const bool of_24 = (form & kOf24) != 0;
    const auto twelve = static_cast<std::uint8_t>(raw->hour & ~kAfternoon);
    const unsigned hour = hour_of(number(of_24 ? raw->hour : twelve), of_24, (raw->hour & kAfternoon) != 0);
    const unsigned minute = number(raw->minute), second = number(raw->second), year = number(raw->year);
    const unsigned hundreds = century != 0 ? number(raw->century) : 20;
    const std::chrono::year_month_day date{std::chrono::year{static_cast<int>(100 * hundreds + year)},
                                           std::chrono::month{number(raw->month)},
                                           std::chrono::day{number(raw->day)}};
    if (hour > 23 || minute > 59 || second > 59 || year > 99 || hundreds < 19 || hundreds > 21 || !date.ok())
        return std::nullopt;
    return std::chrono::sys_days{date}.time_since_epoch().count() * std::int64_t{86'400} + hour * 3600 +
           minute * 60 + second;
}

}  // namespace qduino::board::metal
