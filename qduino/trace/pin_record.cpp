#include "qduino/trace/pin_record.h"

#include <charconv>

#include "base/text.h"
#include "board/types.h"
#include "report/pin/value_change_dump.h"
#include "terminal/human.h"

namespace qduino::apps {
namespace {

constexpr std::uint8_t kHigh = 0x80;

PinWrite write_of(std::uint8_t byte, std::int64_t ns) {
    return {.ns = ns, .pin = static_cast<std::uint8_t>(byte & ~kHigh), .high = (byte & kHigh) != 0};
}

/// The number in front of `text`, which is taken away.
template <typename Number>
std::optional<Number> take_number(std::string_view& text, int base) {
    Number number{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, base);
    if (error != std::errc{}) return {};
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    return number;
}

/// `text` behind `words`, when it begins with them.
bool take_words(std::string_view& text, std::string_view words) {
    if (!text.starts_with(words)) return false;
    text.remove_prefix(words.size());
    return true;
}

struct PortWrite {
    std::int64_t tick = 0;
    unsigned port = 0;
    unsigned value = 0;
};

/// "01234567890d[UNMAP ] unmapped: 8-bit write to 02e8 = 86"
std::optional<PortWrite> port_write_of(std::string_view line) {
    const auto tick = take_number<std::int64_t>(line, 10);
    if (!tick || !take_words(line, "d[UNMAP ] unmapped: 8-bit write to ")) return {};
    const auto port = take_number<unsigned>(line, 16);
    if (!port || !take_words(line, " = ")) return {};
    const auto value = take_number<unsigned>(line, 16);
    if (!value) return {};
    return PortWrite{.tick = *tick, .port = *port, .value = *value};
}

}  // namespace

std::string bytes_of(std::span<const PinWrite> writes) {
    std::string bytes;
    bytes.reserve(writes.size());
    for (const PinWrite& write : writes)
        bytes.push_back(static_cast<char>(write.pin | (write.high ? kHigh : 0)));
    return bytes;
}

std::vector<PinWrite> writes_of(std::string_view bytes) {
    std::vector<PinWrite> writes;
    writes.reserve(bytes.size());
    for (const char c : bytes) writes.push_back(write_of(static_cast<std::uint8_t>(c), 0));
    return writes;
}

BochsLog read_bochs_log(std::string_view log, std::int64_t ns_per_tick) {
    constexpr unsigned kPinsPort = 0x2e8, kEndPort = 0xf4;  // board/metal/pins.h, panic.cpp
    BochsLog read;
    while (!log.empty()) {
        const std::string_view line = log.substr(0, log.find('\n'));
        if (const auto write = port_write_of(line)) {
            if (write->port == kPinsPort)
                read.writes.push_back(
                    write_of(static_cast<std::uint8_t>(write->value), write->tick * ns_per_tick));
            if (write->port == kEndPort) read.status = static_cast<int>(write->value);
        }
        log.remove_prefix(std::min(log.size(), line.size() + 1));
    }
    return read;
}

void PinTally::note(std::size_t pin, bool high) {
    Seen& seen = pins_[pin];
    ++seen.writes;
    seen.rises += high && !seen.high ? 1 : 0;
    seen.high = high;
}

std::string PinTally::table() const {
    std::string out = "Pins, as seen from outside the computer:\n  pin   writes    rises  level at the end\n";
    for (std::size_t i = 0; i < pins_.size(); ++i) {
        if (pins_[i].writes == 0) continue;
        write(out, "  ", column(i, -3), ' ', column(pins_[i].writes, 8), ' ', column(pins_[i].rises, 8),
              pins_[i].high ? "  high\n" : "  low\n");
    }
    return out;
}

std::string pins_table(std::span<const PinWrite> writes) {
    PinTally tally;
    for (const PinWrite& write : writes) tally.note(write.pin, write.high);
    return tally.table();
}

std::string value_change_dump(std::span<const PinWrite> writes) {
    ValueChangeDump dump;
    for (const PinWrite& change : writes) dump.level(change.ns, change.pin, change.high ? '1' : '0');
    const std::string body = dump.take_body();
    return dump.head() + body;
}

}  // namespace qduino::apps
