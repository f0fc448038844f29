#include "arduino/IPAddress.h"

#include <cstring>

IPAddress::IPAddress(std::uint32_t address) { std::memcpy(bytes_.data(), &address, sizeof address); }

IPAddress::operator std::uint32_t() const {
    std::uint32_t address;
    std::memcpy(&address, bytes_.data(), sizeof address);
    return address;
}

bool IPAddress::fromString(const char* text) {
    std::array<std::uint8_t, 4> bytes{};
    for (std::size_t part = 0; part < bytes.size(); ++part) {
        if (part > 0 && *text++ != '.') return false;
        unsigned value = 0;
        int digits = 0;
        for (; *text >= '0' && *text <= '9'; ++text, ++digits) {
            value = value * 10 + static_cast<unsigned>(*text - '0');
            if (value > 255 || digits > 2) return false;
        }
        if (digits == 0) return false;
        bytes[part] = static_cast<std::uint8_t>(value);
    }
    if (*text != '\0') return false;
    bytes_ = bytes;
    return true;
}

String IPAddress::toString() const {
    String text;
    for (std::size_t i = 0; i < bytes_.size(); ++i) {
        if (i > 0) text += '.';
        text += static_cast<int>(bytes_[i]);
    }
    return text;
}

std::size_t IPAddress::printTo(Print& out) const {
    const String text = toString();
    return out.write(text.c_str(), text.length());
}
