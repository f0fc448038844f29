// strtol() and strtoul() for a sketch (tools/ino/as_arduino.py): they end at the limits of 32 bits.
#include <cstdint>
#include <cstdlib>
#include <limits>

namespace {

/// Sets errno as the C library does for a number that is too large. A board may have no <cerrno>.
void note_range() { static_cast<void>(std::strtoll("9999999999999999999", nullptr, 10)); }

bool is_negative(const char* text) {
    while (*text == ' ' || (*text >= '\t' && *text <= '\r')) ++text;
    return *text == '-';
}

}  // namespace

extern "C" {

std::int32_t qduino_strtol(const char* text, char** end, int base) {
    using Limits = std::numeric_limits<std::int32_t>;
    const long long value = std::strtoll(text, end, base);
    if (value >= Limits::min() && value <= Limits::max()) return static_cast<std::int32_t>(value);
    note_range();
    return value < 0 ? Limits::min() : Limits::max();
}

/// A minus sign turns the value around in 32 bits: "-1" is 4294967295.
std::uint32_t qduino_strtoul(const char* text, char** end, int base) {
    constexpr std::uint32_t kMax = std::numeric_limits<std::uint32_t>::max();
    const unsigned long long value = std::strtoull(text, end, base);
    const unsigned long long magnitude = is_negative(text) ? 0 - value : value;
    if (magnitude <= kMax) return static_cast<std::uint32_t>(value);
    note_range();
    return kMax;
}

}  // extern "C"
