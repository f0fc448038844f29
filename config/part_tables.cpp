#include "config/part_tables.h"

#include <algorithm>
#include <limits>
#include <string>

#include "base/words.h"
#include "board/types.h"

namespace qduino::apps {
namespace {

constexpr Words<Chip::hx711, Chip::ir> kChips{"hx711", "ds18b20", "ssd1306", "ws2812", "ir"};
constexpr std::int64_t kLastSerial = (std::int64_t{1} << 48) - 1;

void read_load_cell(TomlSection& s, PartSpec& part) {
    using Limits = std::numeric_limits<std::int32_t>;
    for (const char* pin : {"data", "clock"}) s.require(pin);
    s.integer("data", part.data.number, 0, kLastPin);
    s.integer("clock", part.clock.number, 0, kLastPin);
    s.integer("value", part.value, Limits::min(), Limits::max());
    s.integer("value_b", part.value_b, Limits::min(), Limits::max());
    if (part.data == part.clock) s.fault("clock", "is the pin of 'data'");
}

void read_thermometer(TomlSection& s, PartSpec& part) {
    s.require("data");
    s.integer("data", part.data.number, 0, kLastPin);
    s.number("celsius", part.celsius, -55, 125);
    s.integer("serial", part.serial, 0, kLastSerial);
}

void read_display(TomlSection& s, PartSpec& part) {
    s.integer("bus", part.bus.number, 0, kLastBus);
    s.integer("address", part.address.value, 0, 127);
    s.integer("height", part.height, 32, 64);
    s.text("picture", part.picture);
    if (part.height != 32 && part.height != 64) s.fault("height", "is neither 32 nor 64");
}

void read_strip(TomlSection& s, PartSpec& part) {
    s.require("data");
    s.integer("data", part.data.number, 0, kLastPin);
    s.integer("pixels", part.pixels, 1, 65535);
}

void read_infrared(TomlSection& s, PartSpec& part) {
    s.require("data");
    s.integer("data", part.data.number, 0, kLastPin);
    s.integer("led", part.light.led.number, 0, kLastPin);
    s.instant("at", part.light.at);
    s.integer("remote", part.light.remote, 0, 255);
    s.integer("command", part.light.command, 0, 255);
    s.integer("repeats", part.light.repeats, 0, 1000);
    if (part.data == part.light.led) s.fault("led", "is the pin of 'data'");
}

/// The key whose wire `part` and `other` cannot share; null: they can.
const char* shared_wire(const PartSpec& part, const PartSpec& other) {
    const bool on_bus = part.chip == Chip::ssd1306;
    if (on_bus != (other.chip == Chip::ssd1306)) return nullptr;
    if (on_bus)
        return part.bus.number == other.bus.number && part.address.value == other.address.value ? "address"
                                                                                                : nullptr;
    const bool clocked = part.chip == Chip::hx711, other_clocked = other.chip == Chip::hx711;
    if (part.chip == Chip::ds18b20 && other.chip == Chip::ds18b20)
        return part.data == other.data && part.serial == other.serial ? "serial" : nullptr;
    if (part.data == other.data || (other_clocked && part.data == other.clock)) return "data";
    return clocked && (part.clock == other.data || (other_clocked && part.clock == other.clock)) ? "clock"
                                                                                                 : nullptr;
}

}  // namespace

void read_parts(TomlSection& root, std::vector<PartSpec>& parts) {
    root.tables("part", parts, {"chip"}, [&](TomlSection& s, PartSpec& part) {
        s.choice("chip", part.chip, kChips);
        if (part.chip == Chip::hx711) read_load_cell(s, part);
        if (part.chip == Chip::ds18b20) read_thermometer(s, part);
        if (part.chip == Chip::ssd1306) read_display(s, part);
        if (part.chip == Chip::ws2812) read_strip(s, part);
        if (part.chip == Chip::ir) read_infrared(s, part);
        for (const PartSpec& other : parts) {
            if (&other == &part) break;
            if (const char* const wire = shared_wire(part, other)) s.fault(wire, "is that of another part");
        }
    });
}

}  // namespace qduino::apps
