// IPAddress: an IPv4 address, as four bytes, a 32-bit number in network order, or text.
#pragma once

#include <array>
#include <cstdint>
#include <type_traits>

#include "arduino/Print.h"
#include "arduino/Printable.h"

class IPAddress : public Printable {
  public:
    constexpr IPAddress() = default;
    constexpr IPAddress(std::uint8_t a, std::uint8_t b, std::uint8_t c, std::uint8_t d)
        : bytes_{a, b, c, d} {}
    /// The bytes as they lie in memory: network order.
    IPAddress(std::uint32_t address);  // NOLINT: implicit, as the language has it
    explicit IPAddress(const std::uint8_t* bytes) : bytes_{bytes[0], bytes[1], bytes[2], bytes[3]} {}

    /// Four bytes. (A template, so that `ip = {}` means one thing alone.)
    template <typename Bytes>
    requires std::is_convertible_v<Bytes, const std::uint8_t*> IPAddress& operator=(const Bytes& bytes) {
        return *this = IPAddress(static_cast<const std::uint8_t*>(bytes));
    }

    operator std::uint32_t() const;  // NOLINT
    std::uint8_t operator[](int index) const { return bytes_[static_cast<std::size_t>(index & 3)]; }
    std::uint8_t& operator[](int index) { return bytes_[static_cast<std::size_t>(index & 3)]; }
    bool operator==(const IPAddress& other) const { return bytes_ == other.bytes_; }
    bool operator==(const std::uint8_t* bytes) const { return *this == IPAddress(bytes); }

    /// "192.168.0.7". False, and nothing changed, when `text` is not an address.
    bool fromString(const char* text);
    bool fromString(const String& text) { return fromString(text.c_str()); }
    [[nodiscard]] String toString() const;
    std::size_t printTo(Print& out) const override;

  private:
    std::array<std::uint8_t, 4> bytes_{};
};
