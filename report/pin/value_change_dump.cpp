#include "report/pin/value_change_dump.h"

#include <utility>

#include "base/contract.h"
#include "base/text.h"

namespace qduino::apps {

void ValueChangeDump::at(std::int64_t ns) {
    if (ns != now_) write(body_, '#', ns, '\n');
    now_ = ns;
}

void ValueChangeDump::level(std::int64_t ns, std::uint16_t pin, char value) {
    QDUINO_EXPECT(pin < board::kPinCount);
    if (std::exchange(pins_[pin].level, value) == value) return;
    at(ns);
    write(body_, value, 'p', pin, '\n');
}

void ValueChangeDump::duty(std::int64_t ns, std::uint16_t pin, double duty) {
    QDUINO_EXPECT(pin < board::kPinCount);
    if (std::exchange(pins_[pin].duty, duty) == duty) return;
    at(ns);
    write(body_, 'r', Shortest{duty}, " d", pin, '\n');
}

std::string ValueChangeDump::take_body() { return std::exchange(body_, {}); }

std::string ValueChangeDump::head() const {
    std::string out = "$timescale 1 ns $end\n$scope module pins $end\n", unknown;
    for (std::size_t pin = 0; pin < pins_.size(); ++pin) {
        if (pins_[pin].level != 0) {
            write(out, "$var wire 1 p", pin, " pin", pin, " $end\n");
            write(unknown, "xp", pin, '\n');
        }
        if (pins_[pin].duty >= 0) {
            write(out, "$var real 64 d", pin, " pin", pin, "_duty $end\n");
            write(unknown, "r0 d", pin, '\n');
        }
    }
    write(out, "$upscope $end\n$enddefinitions $end\n#0\n$dumpvars\n", unknown, "$end\n");
    return out;
}

}  // namespace qduino::apps
