#include "arduino/libraries/network/IPAddress.h"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <optional>

#include "base/text.h"

namespace {

constexpr std::size_t kGroups = 8;
using Bytes = std::array<std::uint8_t, 2 * kGroups>;

std::optional<Bytes> parse_v4(std::string_view text) {
    Bytes bytes{};
    const char* at = text.data();
    const char* const end = at + text.size();
    for (std::size_t part = 12; part < bytes.size(); ++part) {
        if (part > 12 && (at == end || *at++ != '.')) return std::nullopt;
        const auto [stopped, failed] = std::from_chars(at, end, bytes[part]);
        if (failed != std::errc{} || stopped - at > 3) return std::nullopt;
        at = stopped;
    }
    if (at != end) return std::nullopt;
    return bytes;
}

/// Groups of one to four hexadecimal digits, with a colon between two. The text may be empty.
struct Groups {
    Bytes bytes{};
    std::size_t count = 0;
};
std::optional<Groups> parse_groups(std::string_view text) {
    Groups groups;
    const char* at = text.data();
    const char* const end = at + text.size();
    while (at != end) {
        if (groups.count == kGroups || (groups.count > 0 && *at++ != ':')) return std::nullopt;
        std::uint16_t value = 0;
        const auto [stopped, failed] = std::from_chars(at, end, value, 16);
        if (failed != std::errc{} || stopped - at > 4) return std::nullopt;
        groups.bytes[2 * groups.count] = static_cast<std::uint8_t>(value >> 8);
        groups.bytes[2 * groups.count + 1] = static_cast<std::uint8_t>(value & 0xff);
        ++groups.count;
        at = stopped;
    }
    return groups;
}

/// RFC 4291, section 2.2, forms 1 and 2: `::` stands once for one group of zeros or more.
std::optional<Bytes> parse_v6(std::string_view text) {
    const std::size_t gap = text.find("::");
    const auto head = parse_groups(text.substr(0, gap));
    if (gap == std::string_view::npos)
        return head && head->count == kGroups ? std::optional(head->bytes) : std::nullopt;
    const auto tail = parse_groups(text.substr(gap + 2));
    if (!head || !tail || head->count + tail->count >= kGroups) return std::nullopt;
    Bytes bytes = head->bytes;
    const auto size = static_cast<std::ptrdiff_t>(2 * tail->count);
    std::copy_n(tail->bytes.begin(), size, bytes.end() - size);
    return bytes;
}

}  // namespace

IPAddress::IPAddress(std::uint32_t address) { std::memcpy(&bytes_[kV4], &address, sizeof address); }

IPAddress::IPAddress(IPType type, const std::uint8_t* bytes) : type_(type) {
    const std::size_t first = type == IPv4 ? kV4 : 0;
    std::copy_n(bytes, bytes_.size() - first, bytes_.data() + first);
}

IPAddress::operator std::uint32_t() const {
    std::uint32_t address = 0;
    if (type_ == IPv4) std::memcpy(&address, &bytes_[kV4], sizeof address);
    return address;
}

bool IPAddress::fromString(const char* text) {
    if (!text) return false;
    const auto v4 = parse_v4(text);
    const auto bytes = v4 ? v4 : parse_v6(text);
    if (!bytes) return false;
    bytes_ = *bytes;
    type_ = v4 ? IPv4 : IPv6;
    return true;
}

String IPAddress::toString() const {
    qduino::FixedString<48> text;
    if (type_ == IPv4) {
        qduino::write(text, bytes_[12], '.', bytes_[13], '.', bytes_[14], '.', bytes_[15]);
    } else {
        constexpr std::string_view kDigits = "0123456789abcdef";
        for (std::size_t i = 0; i < bytes_.size(); ++i) {
            if (i > 0 && i % 2 == 0) text.append(":");
            text.append(kDigits.substr(bytes_[i] >> 4, 1));
            text.append(kDigits.substr(bytes_[i] & 15, 1));
        }
    }
    return String(text.view().data(), static_cast<unsigned>(text.view().size()));
}

std::size_t IPAddress::printTo(Print& out) const {
    if (type_ == IPv4) {
        const String text = toString();
        return out.write(text.c_str(), text.length());
    }
    // The longest run of two groups of zeros or more, the first of several.
    std::size_t gap = 0, gap_length = 1;
    for (std::size_t from = 0; from < kGroups; ++from) {
        std::size_t to = from;
        while (to < kGroups && group(to) == 0) ++to;
        if (to - from <= gap_length) continue;
        gap = from;
        gap_length = to - from;
    }
    qduino::FixedString<48> text;
    for (std::size_t i = 0; i < kGroups; ++i) {
        if (gap_length > 1 && i == gap) {
            text.append("::");
            i += gap_length - 1;
            continue;
        }
        if (!text.view().empty() && text.view().back() != ':') text.append(":");
        qduino::write_characters(text, group(i), 16);
    }
    return out.write(text.view().data(), text.view().size());
}
