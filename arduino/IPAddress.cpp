#include "arduino/IPAddress.h"

#include <charconv>
#include <cstring>

#include "base/text.h"

IPAddress::IPAddress(std::uint32_t address) { std::memcpy(bytes_.data(), &address, sizeof address); }

IPAddress::operator std::uint32_t() const {
    std::uint32_t address;
    std::memcpy(&address, bytes_.data(), sizeof address);
    return address;
}

bool IPAddress::fromString(const char* text) {
    std::array<std::uint8_t, 4> bytes{};
    const char* const end = text + std::strlen(text);
    for (std::size_t part = 0; part < bytes.size(); ++part) {
        if (part > 0 && *text++ != '.') return false;
        const auto [stopped, failed] = std::from_chars(text, end, bytes[part]);
        if (failed != std::errc{} || stopped - text > 3) return false;
        text = stopped;
    }
    if (*text != '\0') return false;
    bytes_ = bytes;
    return true;
}

String IPAddress::toString() const {
    const auto text = qduino::text(bytes_[0], '.', bytes_[1], '.', bytes_[2], '.', bytes_[3]).view();
    return String(text.data(), static_cast<unsigned>(text.size()));
}

std::size_t IPAddress::printTo(Print& out) const {
    const String text = toString();
    return out.write(text.c_str(), text.length());
}
